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

// Of a line turned about z the distance from z is known at every height: no traced triangle is further off
// than the tolerance anywhere, beside the seams of its faces neither.
TEST(Shapes, TwistedRulingsStayWithinTheTolerance) {
    const D3 a{1, -1, -1}, b{1, 1, 1};
    const scene::Primitive p =
        primitive(scene::Quadric{scene::Quadric::Kind::Hyperboloid, {1, -1, -1, 1, 1, 1, 360}});
    for (const bool uniform : {true, false}) {
        const DiceOptions o = looking(4, 800);
        DiceTarget target;
        target.shade_uniform = uniform;
        target.render_from_object = Transform::rotate(70, 1, 0.2, 0);
        Journal journal;
        const Transform back = target.render_from_object.inverse();
        double worst = 0;
        const Soup soup = traced_triangles(dice::dice(p, target, o, {}, journal), 0);
        for (const auto& t : soup)
            for (int i = 0; i <= 4; i++)
                for (int j = 0; i + j <= 4; j++) {
                    const D3 at = t[0] + (t[1] - t[0]) * (i / 4.0) + (t[2] - t[0]) * (j / 4.0);
                    const D3 q = transformed(back, at);
                    const D3 line = a + (b - a) * ((q.z - a.z) / (b.z - a.z));
                    const double r = std::hypot(line.x, line.y), depth = at.z + 4;
                    worst = std::max(worst, std::abs(std::hypot(q.x, q.y) - r) * 400 / depth);
                }
        EXPECT_LT(worst, 0.3) << "pixels, uniform " << uniform << ", " << soup.size() << " triangles";
    }
}
