// Where pictures are taken from: the scene's camera as transport and dicing need it.
#pragma once

#include <span>

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
    // Rendering happens in a world whose origin is near the camera, for precision far from the scene's own.
    std::array<double, 3> origin{};                  // in the world
    Transform render_from_world, camera_from_render; // when the shutter opens
    Vec3f eye, forward{0, 0, 1};                     // in render space; unit
    transport::CameraView view;                      // but for its motion:
    std::vector<float> motion;                       // CameraView::motion; empty = still
    dice::DicingCamera dicing;
};

// Where the camera is when the shutter opens, in the world.
std::array<double, 3> eye_of(const scene::Camera& camera, const Shutter& shutter);

// One origin for the cameras of a shot, so that what stands still has the same place in render space in all
// of its frames: `eyes` are where they are, one after the other, `eye` is one of them. Single precision, so
// far from the origin, moves things nearer than a sixteenth of the usual step between frames by a sixteenth
// of a pixel at most. Long shots have more than one origin, and a camera that jumps away has its own.
std::array<double, 3> origin_of_shot(std::span<const std::array<double, 3>> eyes, std::array<double, 3> eye);

// `options` over those of the scene.
PlacedCamera place_camera(const scene::Camera& camera, const scene::Options& options, const Shutter& shutter,
                          const std::array<double, 3>& origin);

// In render space. They are the camera's, and move with it: then at the times of its motion.
std::vector<bvh::Scene::Plane> clipping_planes(const scene::Camera& of, const PlacedCamera& camera);

} // namespace kanuka::render
