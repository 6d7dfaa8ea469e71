// What a scene holds, for those that build it and those that ask it.
#pragma once

#include <atomic>
#include <vector>

#include "bvh/embree_scene.h"
#include "bvh/few_triangles.h"
#include "bvh/page_scene.h"

namespace kanuka::bvh {

struct Scene::Impl {
    RTCDevice device = nullptr;
    std::unique_ptr<FewTriangles> few; // all of the scene, and nothing is in pages or Embree's; or null
    std::unique_ptr<PageScene> pages;
    std::vector<Group> groups; // of Embree: see build.cpp
    size_t world() const { return groups.size() - 2; }
    const Group& embree() const { return groups[world()]; } // without a scene there is nothing in it
    std::vector<Scene::Plane> planes;                       // that clip, at so many times
    int plane_times = 1;
    std::atomic<int64_t> bytes{0};
    const store::Store& store;

    explicit Impl(const store::Store& store);
    ~Impl();
};

} // namespace kanuka::bvh
