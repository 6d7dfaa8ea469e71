// Prepares what the kernels read: wavelength quantiles, light tables, material code, camera.
#pragma once

#include <span>

#include "color/palette.h"
#include "color/sensor.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

struct LatLong { // an environment picture: rows from +z down, linear Rec.709, 3 floats a texel
    int width = 0, height = 0;
    std::vector<float> rgb;
};

struct SceneInputs {
    const store::Store* store = nullptr;
    const bvh::Scene* bvh = nullptr;
    std::span<const bvh::GroupDesc> groups; // the last is the world; bvh::number_emitters() has been there
    bool instanced = false;
    std::vector<scene::Light> lights;
    color::Palette* palette = nullptr;     // what RGB means; null = Rec.709
    const color::Sensor* sensor = nullptr; // null = the 1931 observer, Rec.709
    LatLong map;                           // of the environment light that has a texture, if any
    Transform render_from_world;
    CameraView camera;
    bool moving = false; // something moves while the shutter is open, or the camera does
    std::vector<float> shutter_quantiles;
    std::span<const float> filter_x, filter_y, filter_weight_x, filter_weight_y;
    SceneView::FilterCells filter_cells;
    std::vector<bool> aov_is_color; // SceneView has the same
    IntegratorChoice integrator;
    float clamp_direct = 0, clamp_indirect = 0; // scene::Options
    int max_depth = 8, volume_depth = 1024;
    bool interreflection = true;          // SceneView has the same
    std::vector<PointLight> point_lights; // SceneView has the same
    uint32_t seed = 0;
};

// `inputs` and what it points to must outlive the view.
SceneView make_scene_view(const SceneInputs& inputs, Journal& journal);

} // namespace kanuka::transport
