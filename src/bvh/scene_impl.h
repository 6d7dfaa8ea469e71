// What a scene holds, for those that build it and those that ask it.
#pragma once

#include <atomic>
#include <vector>

#include "bvh/embree_scene.h"

namespace kanuka::bvh {

struct Scene::Impl {
    RTCDevice device = nullptr;
    std::vector<Group> groups;
    std::vector<Scene::Plane> planes; // that clip, at so many times
    int plane_times = 1;
    std::atomic<int64_t> bytes{0};
    const store::Store& store;

    explicit Impl(const store::Store& store);
    ~Impl();
};

} // namespace kanuka::bvh
