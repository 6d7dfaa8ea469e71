// What tests of instances share: worlds that can be listed triangle by triangle, at any time, and traced so.
#pragma once

#include <gtest/gtest.h>
#include <map>

#include "hierarchy/decode.h"
#include "hierarchy/queue.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy::testing {

// A page, and its triangles as the lattice has them.
struct Thing {
    PageMemory memory;
    std::vector<Face> faces;

    explicit Thing(std::vector<TestGrid> grids) {
        const std::vector<GridView> all = views(grids);
        const Content content{all, {}};
        const Lattice lattice = votes_of(content).lattice();
        memory = build(content, lattice);
        faces = faces_of(grids, lattice);
    }
};

inline Transform product(std::initializer_list<Transform> all) {
    Transform t;
    for (const Transform& next : all)
        t = t * next;
    return t;
}
inline Transform at_random(Random& random, float side, double scale, bool mirrored = false) {
    const Vec3f p = random.in_box(side), axis = random.direction();
    return product(
        {Transform::translate(double(p.x), double(p.y), double(p.z)),
         Transform::rotate(double(random.uniform(0, 360)), double(axis.x), double(axis.y), double(axis.z)),
         Transform::scale(scale * (mirrored ? -1 : 1), scale * double(random.uniform(0.5f, 1.5f)), scale)});
}

struct Flat {
    Point a, b, c;
    uint32_t face;
    InstancePath path;
};
inline Point moved(const Transform& t, const Vec3f& p) {
    double out[3];
    for (size_t a = 0; a < 3; a++)
        out[a] = t.m[a][0] * double(p.x) + t.m[a][1] * double(p.y) + t.m[a][2] * double(p.z) + t.m[a][3];
    return {out[0], out[1], out[2]};
}

// A world whose levels are kept beside it, so that all that stands in them can be listed.
struct Scene {
    World world;
    std::vector<const Thing*> things;               // by page; null = a level
    std::vector<std::vector<Placement>> placements; // by page

    uint32_t add(const Thing& thing) {
        things.push_back(&thing), placements.emplace_back();
        return world.add(thing.memory.page());
    }
    uint32_t add(std::vector<Placement> level) {
        things.push_back(nullptr), placements.push_back(level);
        return world.add(level);
    }
    void list(uint32_t page, const Transform& t, float time, const InstancePath& path,
              std::vector<Flat>& out) const {
        if (things[page])
            for (const Face& f : things[page]->faces)
                out.push_back({moved(t, f.a), moved(t, f.b), moved(t, f.c), f.name, path});
        for (uint32_t i = 0; i < placements[page].size(); i++) {
            InstancePath inner = path;
            inner.instance[inner.depth++] = i;
            const Placement& p = placements[page][i];
            list(p.page, t * (p.path ? p.path->at(double(time)) : p.world_from_page), time, inner, out);
        }
    }
    std::vector<Flat> flat(uint32_t root, float time = 0) const {
        std::vector<Flat> out;
        list(root, {}, time, {}, out);
        return out;
    }
};

struct Expected {
    double t = INFINITY, margin = INFINITY;
    const Flat* flat = nullptr;
    double cosine = 1; // of the ray to the normal: what a place is off by is a distance's error times that
};
inline Expected brute_force(const std::vector<Flat>& all, const Ray& r) {
    Expected best;
    double second = INFINITY;
    const Point o(r.o), d(r.d);
    for (const Flat& f : all) {
        const Point e1 = f.b - f.a, e2 = f.c - f.a, p = cross(d, e2);
        const double det = dot(e1, p);
        if (!(det != 0))
            continue;
        const Point s = o - f.a, q = cross(s, e1);
        const double u = dot(s, p) / det, v = dot(d, q) / det, t = dot(e2, q) / det;
        if (!(t >= double(r.t_min) && t <= double(r.t_max)))
            continue;
        const double inside = std::min({u, v, 1 - u - v});
        best.margin = std::min(best.margin, std::abs(inside));
        if (inside < 0)
            continue;
        if (t < best.t)
            second = best.t, best.t = t, best.flat = &f,
            best.cosine =
                std::abs(dot(cross(e1, e2), d)) / std::sqrt(dot(cross(e1, e2), cross(e1, e2)) * dot(d, d));
        else
            second = std::min(second, t);
    }
    if (best.flat && second < INFINITY)
        best.margin = std::min(best.margin, (second - best.t) / best.t);
    return best;
}

// At surfaces, from around them.
inline std::vector<Ray> rays_at(const std::vector<Flat>& all, size_t count, float away, unsigned seed) {
    Random random(seed);
    std::vector<Ray> rays(count);
    for (Ray& r : rays) {
        const Flat& f = all[random.below(uint32_t(all.size()))];
        const Vec3f at{float((f.a.x + f.b.x + f.c.x) / 3), float((f.a.y + f.b.y + f.c.y) / 3),
                       float((f.a.z + f.b.z + f.c.z) / 3)};
        r.o = at + random.direction() * (away * random.uniform(0.2f, 1));
        r.d = (at - r.o) * random.uniform(0.3f, 2);
    }
    return rays;
}

inline uint32_t face_of(const Thing& thing, const Page& page, const Hit& h,
                        const std::vector<TestGrid>& grids) {
    const Cell cell = cell_of(page, h.leaf, h.primitive / 2);
    uint32_t face = 0;
    for (uint32_t g = 0; g < cell.grid; g++)
        face += uint32_t(grids[g].columns * grids[g].rows * 2);
    EXPECT_LT(face, thing.faces.size());
    return face + uint32_t(cell.row * grids[cell.grid].columns + cell.column) * 2 + h.primitive % 2;
}

inline const std::vector<TestGrid>& ball_grids() {
    static const std::vector<TestGrid> grids = ball(1, 6, 1, 0.1f, 3);
    return grids;
}
inline const Thing& a_ball() {
    static const Thing thing(ball_grids());
    return thing;
}

struct Compared {
    size_t sure = 0, found = 0;
};
// Closest and any, by 8 and 16 lanes, in two orders, beside brute force. Places may be off by `slack` of
// `size`. All of few times.
inline Compared expect_as_brute_force(const Scene& scene, uint32_t root, const std::vector<Ray>& rays,
                                      double size, double slack, const std::vector<float>& times = {}) {
    std::map<float, std::vector<Flat>> all{{0.0f, scene.flat(root)}};
    for (const float time : times)
        if (!all.contains(time))
            all[time] = scene.flat(root, time);
    EverythingIsThere everything;
    std::vector<InstanceHit> eight(rays.size()), sixteen(rays.size()), turned(rays.size());
    std::vector<uint8_t> hidden(rays.size());
    find_closest<8>(scene.world, root, rays, eight, everything, times);
    find_closest<16>(scene.world, root, rays, sixteen, everything, times);
    find_any<8>(scene.world, root, rays, hidden, everything, times);
    const std::vector<Ray> backwards(rays.rbegin(), rays.rend());
    const std::vector<float> times_backwards(times.rbegin(), times.rend());
    find_closest<8>(scene.world, root, backwards, turned, everything, times_backwards);
    std::reverse(turned.begin(), turned.end());
    Compared compared;
    for (size_t i = 0; i < rays.size(); i++) {
        EXPECT_EQ(eight[i], sixteen[i]) << "ray " << i;
        EXPECT_EQ(eight[i], turned[i]) << "ray " << i;
        EXPECT_EQ(hidden[i] != 0, eight[i].hit.found()) << "ray " << i;
        const Expected e = brute_force(all[times.empty() ? 0 : times[i]], rays[i]);
        if (e.margin < 100 * slack)
            continue;
        compared.sure++;
        EXPECT_EQ(eight[i].hit.found(), e.flat != nullptr) << "ray " << i;
        if (!eight[i].hit.found() || !e.flat)
            continue;
        compared.found++;
        const Point d(rays[i].d);
        EXPECT_NEAR(double(eight[i].hit.t), e.t, slack * size / (std::sqrt(dot(d, d)) * e.cosine))
            << "ray " << i;
        EXPECT_EQ(eight[i].path, e.flat->path) << "ray " << i;
        EXPECT_EQ(face_of(a_ball(), a_ball().memory.page(), eight[i].hit, ball_grids()), e.flat->face)
            << "ray " << i;
    }
    return compared;
}

} // namespace kanuka::hierarchy::testing
