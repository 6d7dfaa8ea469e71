// Polygons, meshes of them, and solids.
#pragma once

#include "dice/test_shapes.h"

namespace kanuka::dice::test {

class FlatShapes : public ShapeRandom {
  protected:
    using ShapeRandom::ShapeRandom;

    Loop2 ring(int n, double uneven, double rx, double ry) {
        std::vector<double> a;
        double sum = 0;
        for (int i = 0; i < n; i++)
            a.push_back(sum += 1 + uneven * uniform(-1, 1));
        Loop2 l;
        const double from = uniform(0, Turn);
        for (const double x : a)
            l.push_back({rx * std::cos(from + x / sum * Turn), ry * std::sin(from + x / sum * Turn)});
        if (chance(0.2)) { // a corner on a straight line
            const size_t k = size_t(whole(1, n - 1));
            l.insert(l.begin() + ptrdiff_t(k), {(l[k - 1][0] + l[k][0]) / 2, (l[k - 1][1] + l[k][1]) / 2});
        }
        return l;
    }
    Loop2 star(int points) {
        Loop2 l;
        const double inner = uniform(0.2, 0.7);
        for (int i = 0; i < 2 * points; i++) {
            const double r = i % 2 ? inner : uniform(0.8, 1), a = Turn * i / (2 * points);
            l.push_back({r * std::cos(a), r * std::sin(a)});
        }
        return l;
    }
    Loop2 spiral(int turns) {
        Loop2 l;
        const auto at = [&](double i, double thick) {
            const double a = 1.2 * i, r = 0.15 + 0.85 * i / (2 * turns) - thick;
            return std::array<double, 2>{r * std::cos(a), r * std::sin(a)};
        };
        for (int i = 1; i <= 2 * turns; i++)
            l.push_back(at(i, 0));
        for (int i = 2 * turns; i >= 1; i--)
            l.push_back(at(i, 0.09));
        return l;
    }
    void holed() {
        std::vector<Loop2> loops{ring(whole(3, 8), 0.1, 2.4, 2.4)};
        const int holes = whole(1, 4);
        for (int k = 0; k < holes; k++) {
            const double a = Turn * (k + 0.3) / holes, r = holes > 1 ? 0.6 : 0;
            Loop2 h = chance(0.5) ? ring(whole(3, 8), 0.3, 0.3, 0.2) : star(4);
            for (auto& p : h) {
                const double scale = h.size() == 8 ? 0.3 : 1;
                p = {p[0] * scale + r * std::cos(a), p[1] * scale + r * std::sin(a)};
            }
            if (chance(0.5))
                std::reverse(h.begin(), h.end());
            loops.push_back(h);
        }
        polygon(loops);
    }
    void outline(const std::vector<Loop2>& loops) {
        std::vector<Loop2> exact = loops;
        for (Loop2& l : exact) {
            shape.outline_first.push_back(shape.outline_points.size());
            for (auto& p : l) {
                const D3 q = rounded({p[0], p[1], 0});
                p = {q.x, q.y};
                shape.outline_points.push_back(p);
            }
        }
        shape.outline_first.push_back(shape.outline_points.size());
        shape.hit = hit_polygon(exact);
        shape.flat = true;
    }
    void polygon(std::vector<Loop2> loops) {
        scene::PolygonMesh m;
        std::vector<int32_t> sizes;
        std::vector<D3> points;
        for (const Loop2& l : loops) {
            sizes.push_back(int32_t(l.size()));
            for (const auto& p : l)
                points.push_back(rounded({p[0], p[1], 0}));
        }
        m.vertices_per_loop = sizes;
        if (loops.size() > 1 || chance(0.3))
            m.loops_per_face = std::vector<int32_t>{int32_t(loops.size())};
        outline(loops);
        set(m, points);
    }
    // A lattice of points moved about inside, its cells whole, halved, or joined to hexagons.
    void flat_mesh() {
        const int nx = whole(1, chance(0.3) ? 8 : 3), ny = whole(1, chance(0.3) ? 8 : 2);
        std::vector<D3> points;
        for (int j = 0; j <= ny; j++)
            for (int i = 0; i <= nx; i++) {
                const double dx = i > 0 && i < nx ? uniform(-.2, .2) : 0,
                             dy = j > 0 && j < ny ? uniform(-.2, .2) : 0;
                points.push_back(rounded({i + dx - nx / 2., j + dy - ny / 2., 0}));
            }
        scene::PolygonMesh m;
        std::vector<int32_t> sizes, v;
        const auto add = [&](std::vector<int> f) {
            std::rotate(f.begin(), f.begin() + whole(0, int(f.size()) - 1), f.end());
            sizes.push_back(int32_t(f.size()));
            v.insert(v.end(), f.begin(), f.end());
        };
        const double triangles = uniform(0, 1);
        for (int j = 0; j < ny; j++)
            for (int i = 0; i < nx; i++) {
                const int a = j * (nx + 1) + i, b = a + 1, d = a + nx + 1, c = d + 1;
                if (!chance(triangles) && i + 1 < nx && chance(0.4)) {
                    add({a, b, b + 1, c + 1, c, d});
                    i++;
                } else if (!chance(triangles)) {
                    add({a, b, c, d});
                } else {
                    add({a, b, c});
                    add({a, c, d});
                }
            }
        m.vertices_per_loop = sizes;
        m.vertices = v;
        const double x = nx / 2., y = ny / 2.;
        // The outer points stay on the lattice's border.
        outline({{{-x, -y}, {x, -y}, {x, y}, {-x, y}}});
        set(m, points);
    }

    Cage solid_cage() {
        Cage c;
        const int n = whole(3, 8), which = whole(0, 2);
        const double h = uniform(0.5, 1.5);
        for (const double z : {-h, h})
            for (int i = 0; i < n && (which != 1 || z < 0); i++)
                c.points.push_back(rounded({std::cos(Turn * i / n), std::sin(Turn * i / n), z}));
        std::vector<int> bottom, top;
        for (int i = 0; i < n; i++) {
            bottom.insert(bottom.begin(), i);
            top.push_back(n + i);
        }
        c.faces.push_back(bottom);
        if (which == 1) { // a pyramid
            c.points.push_back(rounded({0, 0, h}));
            for (int i = 0; i < n; i++)
                c.faces.push_back({i, (i + 1) % n, n});
            return c;
        }
        c.faces.push_back(top);
        for (int i = 0; i < n; i++) {
            const int a = i, b = (i + 1) % n;
            if (which == 0) {
                c.faces.push_back({a, b, n + b, n + a});
            } else {
                c.faces.push_back({a, b, n + a});
                c.faces.push_back({b, n + b, n + a});
            }
        }
        return c;
    }
    template <class Mesh>
    static void set_faces(const Cage& c, Mesh& m, scene::Buffer<int32_t>& sizes) {
        std::vector<int32_t> n, v;
        for (const auto& f : c.faces) {
            n.push_back(int32_t(f.size()));
            v.insert(v.end(), f.begin(), f.end());
        }
        sizes = n;
        m.vertices = v;
    }
    void polyhedron() {
        const Cage c = solid_cage();
        scene::PolygonMesh m;
        set_faces(c, m, m.vertices_per_loop);
        shape.soup = triangles_of(c);
        shape.closed = true;
        set(m, c.points);
    }
};

} // namespace kanuka::dice::test
