// Where pictures are taken from: the scene's camera as transport and dicing need it.
#pragma once

#include "bvh/bvh.h"
#include "dice/dice.h"
#include "scene/scene.h"
#include "transport/camera_view.h"

namespace kanuka::render {

// The time that the shutter is open. Equal times: everything is as it is then, sharp.
struct Shutter {
    double open = 0, close = 0;
    bool blurs() const { return close > open; }
    double fraction(double time) const { return blurs() ? (time - open) / (close - open) : time - open; }
};

struct PlacedCamera {
    std::array<double, 3> eye{}; // in the world, when the shutter opens
    // Rendering happens in a world whose origin is that, for precision far from the scene's own origin.
    Transform render_from_world, camera_from_render; // when the shutter opens
    Vec3f forward{0, 0, 1};                          // in render space, unit
    transport::CameraView view;                      // but for its motion:
    std::vector<float> motion;                       // CameraView::motion; empty = still
    dice::DicingCamera dicing;
};

// `options` over those of the scene.
PlacedCamera place_camera(const scene::Camera& camera, const scene::Options& options, const Shutter& shutter);

// In render space. They are the camera's, and move with it: then at the times of its motion.
std::vector<bvh::Scene::Plane> clipping_planes(const scene::Camera& of, const PlacedCamera& camera);

} // namespace kanuka::render
