// Owns what a SceneView refers to and is not of the store, and fills it: material code, lights, media,
// wavelengths.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bvh/bvh.h"
#include "color/palette.h"
#include "color/sensor.h"
#include "scene/scene.h"
#include "transport/light_multipliers.h"
#include "transport/scene_view.h"
#include "transport/wavelengths.h"

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
    std::span<const VariationRow> variations; // as GeometryView has them
    std::vector<scene::Light> lights;
    std::vector<AreaLight> area_lights;    // by store::Links::area_light - 1
    color::Palette* palette = nullptr;     // what RGB means; null = Rec.709
    const color::Sensor* sensor = nullptr; // null = the 1931 observer, Rec.709
    LatLong map;                           // of the environment light that has a texture, if any
    Transform render_from_world;
    CameraView camera;
    bool moving = false;                  // something moves while the shutter is open, or the camera does
    bool fades = false;                   // some paths see other levels of detail of an instance than others
    std::vector<bool> aov_is_color;       // SettingsView has the same
    std::vector<std::string> expressions; // of light paths, whose channels are the last of those
    IntegratorChoice integrator;
    float clamp_direct = 0, clamp_indirect = 0; // scene::Options
    int max_depth = 8, volume_depth = 1024, light_samples = 1;
    bool interreflection = true;          // SettingsView has the same
    std::vector<PointLight> point_lights; // LightsView has the same
    uint32_t seed = 0;
};

// What LightsView refers to, by the same names.
struct LightsData {
    LargeVector<AnalyticLight> analytic;
    std::vector<LightBound> bounds;
    std::vector<float> tables, densities;
    std::vector<AnalyticLight> portals;
    std::vector<PointLight> point_lights;
    std::vector<float> map_rgb;
    PictureCells map_cells;
    SearchGuide map_rows, map_columns;
    LightTree tree, hittable_tree;
    std::vector<int32_t> hittable, suns, fog_lamps;
    struct {
        std::vector<int32_t> emitter, placement;
        std::vector<float> placements, power;
    } slots;
    struct {
        std::vector<float> probability, pdf_area;
        std::vector<int32_t> other, emitters;
    } alias;
};

// What MediaView refers to, by the same names.
struct MediaData {
    std::vector<bsdf::Phase<1>> phases;
    std::vector<float> rows, fields;
    std::vector<int32_t> clear, straight;
    std::vector<int> airs;
};

struct SceneData {
    SceneView view; // stays as it is where SceneData is moved

    std::vector<bsdf::MaterialCode> materials;
    LightsData lights;
    MediaData media;
    std::unique_ptr<const WavelengthTable> wavelengths;
    std::vector<float> spectra; // SpectraView::tables
    std::vector<uint8_t> aov_is_color;
    std::unique_ptr<const PathExpressions> expressions;
    std::unique_ptr<const LightMultipliers> multipliers;

    SceneData() = default;
    // `inputs` and what it points to must outlive the view.
    SceneData(const SceneInputs& inputs, Journal& journal);
    SceneData(SceneData&&) = default;
    SceneData& operator=(SceneData&&) = default;
};

} // namespace kanuka::transport
