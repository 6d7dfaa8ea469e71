#include <cstdlib>
#include <gtest/gtest.h>

#include "base/tasks.h"
#include "dice/test_shape_cases.h"

using namespace kanuka;
using namespace kanuka::dice;
using namespace kanuka::dice::test;

// KANUKA_SHAPES=10000 asks for more; bench/shape_bench.cpp says more of them.
TEST(Shapes, WhatIsTracedIsWhatStandsThere) {
    const char* const more = std::getenv("KANUKA_SHAPES");
    const size_t cases = more ? size_t(std::atoll(more)) : 15 * size_t(Kinds);
    std::vector<ShapeCase> all(cases);
    tasks::parallel_for(cases, [&](size_t i) { all[i] = run_shape(uint32_t(i)); });
    std::array<size_t, Kinds> counted{};
    for (const ShapeCase& c : all) {
        counted[size_t(c.kind)] += c.counted;
        EXPECT_FALSE(c.wrong()) << c.text << ": off by " << c.error << " (tolerance " << c.tolerance
                                << "), twice " << c.twice << ", outline " << c.outline << ", open "
                                << c.open_edges;
    }
    for (int k = 0; k < Kinds; k++)
        EXPECT_GT(counted[size_t(k)], cases / size_t(Kinds) / 3) << KindNames[k];
}

// Area of what is traced of a primitive, of two kinds of rates.
static void expect_area(const scene::Primitive& p, double area, const char* what) {
    for (const float tolerance : {0.25f, 0.0f, 1000.0f})
        for (const bool uniform : {true, false}) {
            DiceOptions o = looking(1.5f, 300);
            o.geometry_tolerance = tolerance;
            DiceTarget target;
            target.shade_uniform = uniform;
            Journal journal;
            double sum = 0;
            for (const auto& t : traced_triangles(dice::dice(p, target, o, {}, journal), 0))
                sum += length(cross(t[1] - t[0], t[2] - t[0])) / 2;
            EXPECT_NEAR(sum / area, 1, 1e-5)
                << what << ", tolerance " << tolerance << ", uniform " << uniform;
        }
}

// Neither a corner lost nor a part there twice: the triangles' areas add up to the shape's.
TEST(Shapes, FlatPolygonsHaveTheirArea) {
    for (const int n : {3, 4, 5, 6, 7, 8, 9, 12}) {
        scene::PolygonMesh m;
        m.vertices_per_loop = std::vector<int32_t>{n};
        std::vector<float> p;
        for (int i = 0; i < n; i++)
            p.insert(p.end(), {float(std::cos(Turn * i / n)), float(std::sin(Turn * i / n)), 0});
        expect_area(primitive(m, p), n * std::sin(Turn / n) / 2, "a regular polygon");
    }
    scene::PolygonMesh triangle;
    triangle.vertices_per_loop = std::vector<int32_t>{3};
    expect_area(primitive(triangle, {-.5f, -.5f, 0, .5f, -.5f, 0, 0, .5f, 0}), 0.5, "a triangle");
}
