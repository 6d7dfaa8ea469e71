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
        target.page_from_object = Transform::rotate(70, 1, 0.2, 0);
        Journal journal;
        const Transform back = target.page_from_object.inverse();
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

// A Hermite curve goes with its transform as the Bezier curve that it is.
TEST(Shapes, CurvesOfAnyBasisAreMovedAsAWhole) {
    const auto middle = [](const char* basis, std::vector<float> points) {
        scene::Curves c;
        c.basis = scene::basis_by_name(basis);
        c.vertices_per_curve = std::vector<int32_t>{4};
        scene::Primitive p = primitive(c, std::move(points));
        p.primvars.set(floats("constantwidth", scene::Type::Float, scene::Detail::Constant, {0.2f}));
        p.primvars.set(floats("N", scene::Type::Normal, scene::Detail::Varying, {0, 0, 1, 0, 0, 1}));
        DiceTarget target;
        target.page_from_object = Transform::translate(3, -2, 1) * Transform::rotate(30, 0, 0, 1);
        Journal journal;
        D3 low{9, 9, 9}, high{-9, -9, -9};
        for (const auto& t : traced_triangles(dice::dice(p, target, looking(6, 400), {}, journal), 0))
            for (const D3& q : t) {
                low = {std::min(low.x, q.x), std::min(low.y, q.y), std::min(low.z, q.z)};
                high = {std::max(high.x, q.x), std::max(high.y, q.y), std::max(high.z, q.z)};
            }
        return (low + high) * 0.5;
    };
    const D3 bezier = middle("bezier", {0, 0, 0, 0.5f, 1, 0, 1.5f, 1, 0, 2, 0, 0}),
             hermite = middle("hermite", {0, 0, 0, 1.5f, 3, 0, 2, 0, 0, 1.5f, -3, 0});
    EXPECT_LT(length(bezier - hermite), 1e-3);
}

// However far from the picture's pixels: the normals of what is traced are the surface's within some degrees.
TEST(Shapes, TwistedRulingsHaveTheirNormals) {
    const D3 a{1, -1, -1}, slope{0, 1, 1}; // of z
    const scene::Primitive p =
        primitive(scene::Quadric{scene::Quadric::Kind::Hyperboloid, {1, -1, -1, 1, 1, 1, 360}});
    for (const bool uniform : {true, false}) {
        DiceOptions o = looking(4, 800);
        o.geometry_tolerance = 1000;
        DiceTarget target;
        target.shade_uniform = uniform;
        Journal journal;
        double worst = 0;
        for (const auto& t : traced_triangles(dice::dice(p, target, o, {}, journal), 0)) {
            const D3 at = (t[0] + t[1] + t[2]) * (1 / 3.0), line = a + slope * (at.z + 1);
            // Of x^2 + y^2 - r(z)^2.
            const D3 normal = unit({at.x, at.y, -(line.x * slope.x + line.y * slope.y)});
            const D3 own = unit(cross(t[1] - t[0], t[2] - t[0]));
            worst = std::max(worst, std::acos(std::min(1.0, std::abs(dot(own, normal)))) * 360 / Turn);
        }
        EXPECT_LT(worst, 6) << "degrees, uniform " << uniform;
    }
}
