// The front of a session: primitives diced, shaded, encoded and made resident; groups and instances laid out
// for the BVH.
#pragma once

#include <atomic>
#include <memory>

#include "base/progress.h"
#include "base/stats.h"
#include "bvh/bvh.h"
#include "dice/dice.h"
#include "render/camera.h"
#include "render/linking.h"
#include "render/made_again.h"
#include "render/oracle.h"
#include "render/page_cache.h"
#include "scene/scene.h"
#include "shade/shade.h"
#include "store/disk_store.h"
#include "transport/variation_row.h"

namespace kanuka::render {

struct Geometry {
    explicit Geometry(size_t store_window) : store(store_window) {}

    store::Store store;
    std::vector<bvh::GroupDesc> groups;              // the last is the world
    std::vector<scene::Buffer<float>> matrices;      // of the scene, that the groups' instances point to
    std::vector<std::vector<float>> transforms;      // others, that they point to as well
    std::vector<std::vector<MotionPath>> paths;      // and the moving ones
    std::vector<std::vector<uint32_t>> numbers;      // of matrices, where instances point to some of them
    std::vector<std::vector<int>> levels_of_scene;   // of the scene's groups among those here, finest first
    std::vector<Vec3f> center_of_scene;              // GroupView::center of each of them
    std::vector<transport::VariationRow> variations; // that groups' instances name by number; none: empty
    bool instanced = false;
    bool moving = false; // something moves while the shutter is open
    bool fades = false;  // some paths see other levels of detail of an instance than others
    Digest key;          // of all that it was made of, where GeometryRequest::pages are kept
};

struct GeometryRequest {
    const scene::Scene& scene;
    shade::ShadingSystem& shading;
    const color::Palette& palette;
    dice::DiceOptions dice;
    Transform render_from_world;
    Shutter shutter;
    Journal& journal;
    Stats& stats;
    const Progress& progress;
    const Linking& linking;
    std::vector<bvh::Scene::Plane> clips; // in render space
    uint64_t memory;                      // that there is for geometry
    size_t store_window = store::Store::LargestWindow;
    bool classic = false;                   // surfaces light nothing, but for area lights
    PageCache* pages = nullptr;             // what was made before; null = nothing is kept
    store::DiskStore* disk = nullptr;       // with `pages`; null = none
    const DicingOracle* oracle = nullptr;   // null = the camera alone says how finely
    uint64_t working_memory = ~uint64_t(0); // and for primitives on the way to the store
    uint64_t memory_budget = 0;             // that pages come and go within; 0 = none
    Digest setting = {};                    // of what all materials depend on; for keys of pages
    MadeAgain* made_again = nullptr;        // with `pages`; null = nobody asks why
    float instance_levels = 0;              // of detail: scene::Options has the same, as of the next two
    int instance_variants = 8;
    uint64_t unique_up_to = 0;
};

// Thread count changes nothing in what is built.
std::unique_ptr<Geometry> build_geometry(const GeometryRequest& request);
// `request.scene` is a part that goes on from what was built: its groups are numbered on, and its primitives
// become a group of their own that stands in the world.
void extend_geometry(const GeometryRequest& request, Geometry& geometry);

} // namespace kanuka::render
