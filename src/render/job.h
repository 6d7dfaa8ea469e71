// What the stages of a picture are told: a scene, and what was set over it.
#pragma once

#include <chrono>

#include "base/progress.h"
#include "base/stats.h"
#include "render/aovs.h"
#include "render/session.h"
#include "transport/integrator.h"

namespace kanuka::render {

struct Job {
    using Clock = std::chrono::steady_clock;
    Clock::time_point start = Clock::now();
    const scene::Scene& scene;
    scene::Options options;
    scene::Camera camera;
    std::vector<scene::Camera> shot; // of all frames that are rendered together; empty = of one
    Journal& journal;
    Stats* stats;
    const Progress* progress; // of the call that is at work
    std::optional<Part> part; // none = the whole picture
    int lanes;
    std::string standard_shaders;
    scene::Delayed* delayed;
    uint64_t memory, page_memory; // bytes that there are, and that pages are kept in
    MemoryBudget memory_budget;   // what is large may take no more of them
    uint64_t geometry_memory;     // memory, or, with a budget, what the disk has room for
    size_t store_window;
    bvh::PagesFrom pages_from;
    store::DiskStore::Settings store; // no folder = none
    std::string oracle;               // file; empty = none
    float shading_rate;
    bool may_face; // nobody chose an integrator
    transport::IntegratorChoice integrator;
    Aovs aovs;

    Shutter shutter() const { return {double(options.shutter_open), double(options.shutter_close)}; }
    Location where() const { return {scene.file}; }
};

} // namespace kanuka::render
