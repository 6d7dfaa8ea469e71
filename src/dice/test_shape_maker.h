// Quadrics, subdivision meshes, points, curves, blobs; and any of all.
#pragma once

#include "dice/test_patch_shapes.h"

namespace kanuka::dice::test {

class ShapeMaker : public PatchShapes {
  public:
    ShapeMaker(Kind kind, uint32_t seed, double stretch = 0) : PatchShapes(seed, stretch) { make(kind); }

  private:
    void make(Kind kind) {
        switch (kind) {
        case Kind::Convex:
            return polygon({ring(whole(3, chance(0.2) ? 14 : 7), chance(0.3) ? 0.0 : 0.4, 1, 1)});
        case Kind::Concave:
            return chance(0.5) ? polygon({star(whole(3, 9))}) : polygon({spiral(whole(3, 7))});
        case Kind::Holed:
            return holed();
        case Kind::FlatMesh:
            return flat_mesh();
        case Kind::Polyhedron:
            return polyhedron();
        case Kind::Bilinear:
        case Kind::Bicubic:
        case Kind::BilinearMesh:
        case Kind::BicubicMesh:
            return patches(kind == Kind::Bicubic || kind == Kind::BicubicMesh,
                           kind == Kind::BilinearMesh || kind == Kind::BicubicMesh);
        case Kind::Nurbs:
            return nurbs();
        case Kind::RationalDisc:
            return rational_disc();
        case Kind::Trimmed:
            return trimmed();
        case Kind::Catmull:
        case Kind::CatmullSheet:
        case Kind::Loop:
            return subdivision(kind);
        case Kind::Balls:
        case Kind::Discs:
            return points(kind);
        case Kind::Ribbon:
            return ribbon();
        case Kind::Blob:
            return blob();
        default:
            return quadric(scene::Quadric::Kind(int(kind) - int(Kind::Sphere)));
        }
    }

    void quadric(scene::Quadric::Kind kind) {
        using K = scene::Quadric::Kind;
        const double sweep = chance(0.5) ? 360 : uniform(20, 350) * (chance(0.3) ? -1 : 1);
        const double r = uniform(0.5, 1.5) * m_stretch, h = uniform(0.2, 2);
        const bool part = chance(0.5);
        std::vector<double> a;
        switch (kind) {
        case K::Sphere:
            a = {r, part ? -r * uniform(0, 0.9) : -r, part ? r * uniform(0.2, 1) : r};
            break;
        case K::Cone:
            a = {h, r};
            break;
        case K::Cylinder:
            a = {r, -h, h};
            break;
        case K::Hyperboloid:
            a = {
                r, uniform(-1, 1), -h, uniform(-1, 1) * r, uniform(-1.5, 1.5), part ? h : h * uniform(-1, 1)};
            break;
        case K::Paraboloid:
            a = {r, part ? h * uniform(0, 0.8) : 0, h};
            break;
        case K::Disk:
            a = {part ? h : 0, r};
            break;
        case K::Torus:
            a = {r + 0.5, uniform(0.1, 0.45) * r, part ? uniform(-180, 0) : 0, part ? uniform(30, 180) : 360};
            break;
        }
        a.push_back(sweep);
        const std::vector<float> f = floats_of(a);
        if (kind == K::Hyperboloid)
            shape.soup = hyperboloid(f);
        else if (kind == K::Torus)
            shape.soup = torus(f);
        else
            shape.hit = hit_quadric(kind, f);
        shape.closed = sweep == 360 && ((kind == K::Sphere && !part) || (kind == K::Torus && !part));
        shape.flat = kind == K::Disk;
        shape.primitive = primitive(scene::Quadric{kind, f});
        switch (kind) {
        case K::Sphere:
            return box(r, r, a[1], a[2]);
        case K::Cone:
            return box(r, r, 0, h);
        case K::Cylinder:
            return box(r, r, -h, h);
        case K::Hyperboloid: {
            const double m = std::max(std::hypot(a[0], a[1]), std::hypot(a[3], a[4]));
            return box(m, m, std::min(a[2], a[5]), std::max(a[2], a[5]));
        }
        case K::Paraboloid:
            return box(r, r, a[1], h);
        case K::Disk:
            return box(r, r, a[0], a[0]);
        case K::Torus:
            return box(a[0] + a[1], a[0] + a[1], -a[1], a[1]);
        }
    }

    void subdivision(Kind kind) {
        scene::SubdivisionMesh m;
        Cage c;
        if (kind == Kind::Catmull) {
            c = solid_cage();
            const int which = whole(0, 3);
            const double sharp = which == 1 ? 10 : which == 2 ? whole(1, 3) : uniform(0.2, 2.5);
            if (which > 0) { // a ring of edges is a crease
                const int n = int(c.faces[0].size());
                scene::SubdivisionMesh::Tag tag{"crease", {}, {float(sharp)}, {}};
                for (int i = 0; i <= n; i++) {
                    tag.ints.push_back(i % n);
                    if (i < n)
                        c.creases[{std::min(i, (i + 1) % n), std::max(i, (i + 1) % n)}] =
                            double(float(sharp));
                }
                m.tags.push_back(tag);
            }
            shape.closed = true;
        } else {
            const bool loop = kind == Kind::Loop;
            const int nx = whole(1, 4), ny = whole(1, 4);
            const double z = bend(), triangles = loop ? 1 : uniform(0, 1);
            for (int j = 0; j <= ny; j++)
                for (int i = 0; i <= nx; i++)
                    c.points.push_back(rounded(
                        {i - nx / 2. + uniform(-.2, .2), j - ny / 2. + uniform(-.2, .2), uniform(-z, z)}));
            for (int j = 0; j < ny; j++)
                for (int i = 0; i < nx; i++) {
                    const int a = j * (nx + 1) + i, b = a + 1, d = a + nx + 1, e = d + 1;
                    if (chance(triangles)) {
                        c.faces.push_back({a, b, e});
                        c.faces.push_back({a, e, d});
                    } else if (i + 1 < nx && chance(0.3)) {
                        c.faces.push_back({a, b, b + 1, e + 1, e, d});
                        i++;
                    } else {
                        c.faces.push_back({a, b, e, d});
                    }
                }
            c.loop = loop;
            m.scheme = loop ? "loop" : "catmull-clark";
            m.tags.push_back({"interpolateboundary", {1}, {}, {}});
            shape.flat = z == 0;
        }
        set_faces(c, m, m.vertices_per_face);
        shape.soup = limit_surface(c, 6000);
        set(m, c.points);
    }

    void points(Kind kind) {
        const int n = whole(1, 4);
        std::vector<D3> p;
        std::vector<float> width;
        std::vector<double> r;
        for (int i = 0; i < n; i++) {
            p.push_back(rounded({2.5 * i, 0, 0}));
            width.push_back(float(uniform(1, 2)));
            r.push_back(double(width.back()) / 2);
        }
        const double s = m_stretch;
        for (const double x : {-1.0, 2.5 * s * (n - 1) + 1})
            for (const double y : {-1.0, 1.0})
                for (const double z : {-1.0, 1.0})
                    shape.hull.push_back({x, y, kind == Kind::Balls ? z : 0});
        set(scene::Points{}, p);
        auto& primvars = shape.primitive.primvars;
        primvars.set(test::floats("width", scene::Type::Float, scene::Detail::Varying, width));
        if (kind == Kind::Balls) {
            shape.hit = [=](const D3& o, const D3& d) {
                for (int i = 0; i < n; i++) {
                    const D3 q = o - p[i];
                    const double b = dot(q, d);
                    if (b * b >= dot(d, d) * (dot(q, q) - r[i] * r[i]))
                        return true;
                }
                return false;
            };
            return;
        }
        shape.flat = true;
        std::vector<float> N;
        for (int i = 0; i < n; i++)
            N.insert(N.end(), {0, 0, 1});
        primvars.set(test::floats("N", scene::Type::Normal, scene::Detail::Varying, N));
        scene::Value type;
        type.name = "type";
        type.type = scene::Type::String;
        type.detail = scene::Detail::Constant;
        type.strings = std::vector<std::string>{"disk"};
        primvars.set(type);
        shape.hit = [=](const D3& o, const D3& d) {
            const D3 q = o - d * (o.z / d.z);
            for (int i = 0; i < n; i++) {
                const double x = q.x - p[i].x, y = q.y;
                if (x * x + y * y <= r[i] * r[i])
                    return true;
            }
            return false;
        };
    }
    // A straight curve across N.
    void ribbon() {
        scene::Curves c;
        c.cubic = chance(0.5);
        c.basis = scene::basis_by_name("bezier");
        const int n = c.cubic ? 4 : whole(2, 5);
        c.vertices_per_curve = std::vector<int32_t>{n};
        std::vector<D3> p;
        for (int i = 0; i < n; i++)
            p.push_back(rounded({double(i), 0, 0}));
        const float width = float(uniform(0.3, 1.5));
        const double x1 = p.back().x, y = double(width) / 2;
        outline_of_rectangle(x1, y);
        set(c, p);
        auto& primvars = shape.primitive.primvars;
        primvars.set(test::floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {width}));
        std::vector<float> N;
        for (int i = 0; i < (c.cubic ? 2 : n); i++)
            N.insert(N.end(), {0, 0, 1});
        primvars.set(test::floats("N", scene::Type::Normal, scene::Detail::Varying, N));
    }
    void outline_of_rectangle(double x1, double y) {
        shape.hit = hit_polygon({{{0, -y}, {x1, -y}, {x1, y}, {0, y}}});
        shape.flat = true;
        shape.hull = {{0, -y, 0}, {x1, -y, 0}, {x1, y, 0}, {0, y, 0}};
    }
    // RISpec 5.6: (1 - r^2)^3 reaches the threshold 0.421875 at half of the unit radius.
    void blob() {
        scene::Blobby b;
        b.code = std::vector<int32_t>{1001, 0};
        b.leaves = 1;
        const double x = double(float(uniform(0.5, 2) * m_stretch)), y = double(float(uniform(0.5, 2)));
        b.floats = std::vector<float>{float(x), 0, 0, 0, 0, float(y), 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        shape.primitive = primitive(b);
        shape.hit = [=](const D3& o, const D3& d) {
            const D3 p{o.x / x, o.y / y, o.z}, q{d.x / x, d.y / y, d.z};
            const double k = dot(p, q);
            return k * k >= dot(q, q) * (dot(p, p) - 0.25);
        };
        shape.closed = true;
        box(x / 2, y / 2, -0.5, 0.5);
    }
};

} // namespace kanuka::dice::test
