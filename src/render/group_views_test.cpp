// Which levels of detail instances show, and how that changes as the camera moves.
#include "render/group_views.h"

#include <gtest/gtest.h>

namespace kanuka::render {
namespace {

// Of each level, the finest first: which part of all paths sees it.
std::vector<double> shares(const GroupView& view, float wanted) {
    const int levels = 1 + int(view.coarser.size());
    std::vector<double> parts(size_t(levels), 0.0);
    const ShownLevels shown = shown_levels(view, levels, wanted);
    uint32_t next = 0; // every path sees one
    for (const ShownLevel& each : shown.all()) {
        EXPECT_EQ(each.range.from, next);
        next = each.range.last + 1u;
        parts[size_t(each.level)] = (next - each.range.from) / double(LevelRange::Steps);
    }
    EXPECT_EQ(next, LevelRange::Steps);
    return parts;
}

// What an instance shows, by rates: the mean of the logarithm.
double shown_rate(const GroupView& view, float wanted) {
    const std::vector<double> parts = shares(view, wanted);
    double sum = parts[0] * std::log2(double(view.pixels_per_unit));
    for (size_t k = 1; k < parts.size(); k++)
        sum += parts[k] * std::log2(double(view.coarser[k - 1]));
    return sum;
}

// A crowd along a line, from `nearest` on.
GroupView crowd(float nearest) {
    scene::Scene scene;
    scene.groups.emplace_back();
    scene::Primitive ball;
    ball.geometry = scene::Quadric{scene::Quadric::Kind::Sphere, {1, -1, 1, 360}};
    scene.groups[0].primitives.push_back(ball);
    std::vector<float> places;
    for (int i = 0; i < 20; i++) {
        const float row[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, nearest * std::exp2(0.5f * float(i))};
        places.insert(places.end(), row, row + 12);
    }
    scene.instances.push_back({.group = 0, .transforms = std::move(places)});
    dice::DicingCamera camera;
    camera.pixels_per_tangent = 4000;
    camera.width = camera.height = 2000;
    return GroupViews(scene, 0, Transform(), camera, {1, 1})[0];
}

} // namespace

TEST(InstanceLevels, ArePowersOfFourBelowTheFinest) {
    const GroupView view = crowd(3);
    ASSERT_GE(view.coarser.size(), 2u);
    EXPECT_LE(4 * view.coarser[0], view.pixels_per_unit);
    EXPECT_GT(16.001f * view.coarser[0], view.pixels_per_unit);
    for (size_t k = 0; k < view.coarser.size(); k++) {
        EXPECT_EQ(std::remainder(std::log2(view.coarser[k]), 2.0f), 0);
        if (k > 0) {
            EXPECT_EQ(4 * view.coarser[k], view.coarser[k - 1]);
        }
    }
}

TEST(InstanceLevels, ShareAllPathsAndAreNeverTooCoarse) {
    const GroupView view = crowd(3);
    for (float wanted = view.pixels_per_unit; wanted > 0.1f; wanted *= 0.97f) {
        const std::vector<double> parts = shares(view, wanted);
        for (size_t k = 1; k < parts.size(); k++)
            if (parts[k] > 0) {
                EXPECT_GE(view.coarser[k - 1], wanted);
            }
    }
    EXPECT_EQ(shares(view, INFINITY)[0], 1);
    EXPECT_EQ(shares(view, 1e-9f).back(), 1);
}

// In steps of a hundredth of the distance, of a thing far away and of the closest one, whose coming nearer
// makes new levels.
TEST(InstanceLevels, ChangeLittleByLittle) {
    const GroupView view = crowd(3);
    double last = shown_rate(view, view.pixels_per_unit);
    for (float wanted = view.pixels_per_unit; wanted > 0.5f; wanted /= 1.01f) {
        const double now = shown_rate(view, wanted);
        EXPECT_NEAR(now, last, 4 * std::log2(1.01) / 0.5 + 1e-3) << wanted; // four octaves in half of one
        last = now;
    }
    for (const float wanted : {1.0f, 12.0f, 50.0f, 60.0f}) {
        double before = shown_rate(crowd(16), wanted);
        for (float nearest = 16; nearest > 2.5f; nearest /= 1.01f) {
            const GroupView here = crowd(nearest);
            const double now = shown_rate(here, wanted);
            EXPECT_NEAR(now, before, 0.12) << nearest << ' ' << wanted;
            before = now;
        }
    }
}

} // namespace kanuka::render
