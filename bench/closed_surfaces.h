// Closed surfaces that ray_bench looks at from inside: as they are diced, as meshes, and as instances.
#pragma once

#include <string>

#include "hierarchy_scenes.h"

#include "dice/test_closed_shapes.h"
#include "grid/trimmed.h"
#include "hierarchy/instances.h"

namespace kanuka::hierarchy::bench {

constexpr double MostScale = 1.5; // of an instance

struct ClosedSurface {
    std::vector<TestGrid> grids;
    std::vector<float> positions; // of a mesh
    std::vector<uint32_t> corners;
    bool is_grid = false;                     // the mesh's vertices are vertices of grids too
    std::vector<Transform> places;            // of instances; none: it lies there as it is
    std::vector<MotionPath> paths;            // of those that move, from their places on
    std::vector<std::vector<TestGrid>> later; // grids that change, as they are at further even times,
    std::vector<Vec3f> centres;               // and where balls of this radius are inside of them
    float clear = 0;

    const std::vector<TestGrid>& step(size_t k) const { return k == 0 ? grids : later[k - 1]; }
    // A point inside of what changes.
    Vec3f inside(Random& random, float time) const {
        const Interval at(time, uint32_t(later.size()));
        const Vec3f centre = centres[at.number] + (centres[at.number + 1] - centres[at.number]) * at.fraction;
        return centre + random.direction() * (clear * random.uniform());
    }
    Transform place(size_t i, float time) const {
        return paths.empty() ? places[i] : paths[i].at(double(time));
    }

    // What dicing made.
    void add(const dice::Diced& d) {
        for (size_t i = 0; i < d.grids.size(); i++)
            if (d.trimmed.empty() || d.trimmed[i].indices.empty())
                grids.push_back({d.traced[i].mu, d.traced[i].mv, d.traced[i].P});
            else
                add_cut(d.grids[i], d.trimmed[i]);
        if (d.is_mesh)
            add_mesh(d.mesh_vertices, d.mesh);
    }
    void add_mesh(const grid::Grid& vertices, const grid::TracedMesh& mesh) {
        const uint32_t first = uint32_t(positions.size() / 3);
        const std::vector<float>& moved = mesh.P;
        for (int i = 0; i < vertices.vertices(); i++)
            for (int c = 0; c < 3; c++)
                positions.push_back(moved.empty() ? vertices.position(i)[c]
                                                  : moved[size_t(i) + size_t(c) * size_t(vertices.stride)]);
        const size_t sides = size_t(mesh.vertices_per_face);
        for (size_t f = 0; f < mesh.indices.size(); f += sides) {
            const uint32_t* v = &mesh.indices[f];
            if (sides == 3)
                corners.insert(corners.end(), {first + v[0], first + v[1], first + v[2]});
            else
                corners.insert(corners.end(), {first + v[0], first + v[1], first + v[3], first + v[2],
                                               first + v[3], first + v[1]});
        }
    }
    void add_cut(const grid::Grid& g, const grid::TrimmedMesh& cut) {
        grid::VertexInputs none, merged;
        none.stride = g.stride;
        grid::Grid vertices;
        grid::TracedMesh mesh;
        const grid::TrimmedPart part{&g, &none, &cut};
        grid::merge_trimmed({&part, 1}, {}, vertices, merged, mesh);
        add_mesh(vertices, mesh);
        is_grid = true;
    }
};

// A ball that swells, waves and flies, at two to five times. Its vertices go straight from one time to the
// next, each on its own ray from the centre: so half of what is clear of all of them is clear in between.
inline ClosedSurface changing_surface(uint32_t seed) {
    ClosedSurface s;
    Random random(seed);
    const int steps = 1 + int(seed % 4);
    Vec3f centre(0.0f);
    s.clear = 1e30f;
    for (int k = 0; k <= steps; k++) {
        std::vector<TestGrid> ball = testing::ball(2 + int(seed % 3), 16, 1 + 0.3f * float(k), 0.2f,
                                                   4 + float((seed + uint32_t(k)) % 5));
        for (TestGrid& g : ball)
            for (size_t i = 0; i < g.positions.size(); i += 3) {
                const Vec3f p(g.positions[i], g.positions[i + 1], g.positions[i + 2]);
                s.clear = std::min(s.clear, 0.5f * length(p));
                for (int c = 0; c < 3; c++)
                    g.positions[i + size_t(c)] += centre[c];
            }
        (k == 0 ? s.grids : s.later.emplace_back()) = std::move(ball);
        s.centres.push_back(centre);
        centre += random.in_box(1);
    }
    return s;
}

// Surfaces of a kind, by number.
inline ClosedSurface closed_surface(const std::string& kind, uint32_t seed) {
    using dice::test::ClosedShape;
    ClosedSurface s;
    Journal journal;
    if (kind == "changing")
        return changing_surface(seed);
    if (kind == "subdivided")
        s.add(ClosedShape(4 * seed).diced(journal));
    else if (kind == "displaced") // subdivision meshes and NURBS, and every fourth time overhanging grids
        if (seed % 4 == 3)
            s.grids = cave(4 + int(seed / 4) % 4).grids;
        else
            s.add(ClosedShape(4 * (seed / 2) + 2 + seed % 2).diced(journal));
    else if (kind == "trimmed")
        for (const bool outside : {false, true})
            s.add(ClosedShape::trimmed(seed, outside).diced(journal));
    else { // meshes, and instances of grids, that move or not
        const std::vector<TestGrid> ball = testing::ball(2 + int(seed % 3), 16, 1, 0.2f, 4 + float(seed % 5));
        if (kind == "mesh") {
            testing::MeshOfGrids mesh(ball);
            s.positions = std::move(mesh.positions), s.corners = std::move(mesh.corners);
        } else {
            s.grids = ball;
            Random random(seed);
            for (int i = 0; i < 64; i++) { // apart, turned, stretched, every second one mirrored
                const Vec3f axis = random.direction();
                const double size = double(random.uniform(0.3f, float(MostScale)));
                s.places.push_back(
                    Transform::translate(5.0 * (i % 4), 5.0 * (i / 4 % 4), 5.0 * (i / 16)) *
                    Transform::rotate(double(random.uniform(0, 360)), double(axis.x), double(axis.y),
                                      double(axis.z)) *
                    Transform::scale(i % 2 ? -size : size, size * double(random.uniform(0.5f, 1)), size));
            }
            for (size_t i = 0; kind == "moving" && i < s.places.size(); i++) { // no turns: Embree has no arcs
                const Vec3f way = random.in_box(0.5f);
                const TransformKey keys[2] = {
                    {0, s.places[i]},
                    {1, Transform::translate(double(way.x), double(way.y), double(way.z)) * s.places[i]}};
                s.paths.emplace_back(keys);
            }
        }
    }
    return s;
}

} // namespace kanuka::hierarchy::bench
