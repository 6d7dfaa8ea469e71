// Builds Embree's scenes: which geometry each of the store's shapes becomes, and instances of other groups.
// A group may be there twice: without what pages hold, and whole where it bounds solids.
#include <algorithm>
#include <map>
#include <utility>

#include "base/cancel.h"
#include "base/error.h"
#include "base/tasks.h"
#include "bvh/leftovers.h"
#include "bvh/scene_impl.h"

namespace kanuka::bvh {

namespace {

// Up to this many cells, the opaque grids of a group become quads: 78 bytes a cell instead of 17, and rays a
// tenth faster (Cornell box, a ball on a plane; four incoherent rays for three on a height field).
constexpr size_t MostQuads = size_t(1) << 18;

Bounds3f box_of(const Group& group) {
    const RTCBounds b = bounds_of(group);
    Bounds3f box;
    box.lo = {b.lower_x, b.lower_y, b.lower_z};
    box.hi = {b.upper_x, b.upper_y, b.upper_z};
    return box;
}

class Builder {
  public:
    Builder(RTCDevice device, const store::Store& store, const PageScene& pages, std::vector<Group>& groups,
            std::atomic<int64_t>& bytes, Scene::Build build)
        : m_device(device), m_store(store), m_pages(pages), m_groups(groups), m_bytes(bytes),
          m_build(std::move(build)) {}

    // All groups that the world needs.
    void run(std::span<const GroupDesc> descs) {
        std::vector<bool> needed(m_groups.size());
        needed[place_of(int(descs.size()) - 1, false)] = true;
        for (size_t at = m_groups.size(); at-- > 0;)
            if (needed[at])
                for (const auto& in : descs[at / 2].instances)
                    if (!lies_in_pages(in))
                        needed[target_of(in, at % 2 != 0)] = true;
        for (size_t at = 0; at < m_groups.size(); at++)
            if (needed[at])
                add(descs, at);
    }

  private:
    // Of a group without what pages hold, and whole.
    static size_t place_of(int group, bool whole) { return 2 * size_t(group) + whole; }
    static size_t target_of(const GroupDesc::Instances& in, bool whole) {
        return place_of(in.group, whole || in.bounds_solid);
    }

    bool lies_in_pages(const GroupDesc::Instances& in) const {
        return in.bounds_solid && m_pages.holds_solids();
    }

    // After those of lower numbers.
    void add(std::span<const GroupDesc> descs, size_t at) {
        const GroupDesc& desc = descs[at / 2];
        m_whole = at % 2 != 0;
        Group& group = m_groups[at];
        group.scene = new_scene();
        if (!m_pages.holds_solids())
            group.trees = SolidTrees(desc.solids);
        if (!group.trees.empty())
            group.solids = new_scene();
        add_shapes(group, desc, at / 2);
        for (const auto& instances : desc.instances)
            if (!lies_in_pages(instances) && m_groups[target_of(instances, m_whole)].scene)
                add_instances(group, instances, descs[size_t(instances.group)]);
        if (group.geometries.empty()) { // all of it lies in pages, or it is nothing
            for (RTCScene* s : {&group.scene, &group.solids})
                if (*s)
                    rtcReleaseScene(std::exchange(*s, nullptr));
            return;
        }
        commit(group.scene);
        if (group.solids)
            commit(group.solids);
    }

    RTCScene new_scene() const {
        RTCScene s = rtcNewScene(m_device);
        // No flag for filters of a query's own: there are none, and without it Embree takes intersectors
        // that call no filters wherever no geometry has one.
        rtcSetSceneFlags(s, RTCSceneFlags((m_build.watertight ? RTC_SCENE_FLAG_ROBUST : 0) |
                                          (m_build.compact ? RTC_SCENE_FLAG_COMPACT : 0)));
        return s;
    }

    void add_shapes(Group& group, const GroupDesc& desc, size_t number) {
        // Grids by whether hits are filtered, their steps, and how far apart those lie; by the solid that
        // they bound; and by the window of the store that they lie in.
        std::map<std::array<int32_t, 5>, std::vector<int>> grids;
        const SolidTrees trees(desc.solids);
        const bool is_plain = m_pages.holds_solids() && trees.empty(); // here it bounds nothing
        for (const auto& range : desc.shapes) {
            const int solid = is_plain ? -1 : trees.bounded_by(range.solid);
            for (int s = range.first; s < range.first + range.count; s++) {
                const store::ShapeRecord& shape = m_store.shapes()[size_t(s)];
                if (!m_whole && m_pages.holds(number, shape, solid))
                    continue;
                if (shape.flags & store::ShapeRecord::Mesh)
                    add_mesh(group, s, solid);
                else
                    grids[{is_partly_there(m_store, shape), shape.motion_segments,
                           shape.motion_segments > 0 ? shape.motion_stride : 0, solid,
                           m_store.window(shape.program)}]
                        .push_back(s);
            }
        }
        for (const auto& [kind, list] : grids) {
            size_t cells = 0;
            for (int shape : list)
                cells +=
                    size_t(m_store.shapes()[size_t(shape)].mu) * size_t(m_store.shapes()[size_t(shape)].mv);
            const bool opaque = kind[0] == 0, still = kind[1] == 0;
            if (opaque && still && cells > 0 && cells <= MostQuads && !m_build.compact)
                add_quads(group, list, cells, kind[3]);
            else
                add_grids(group, list, kind[3]);
        }
    }

    // `ours`: null for instances, of which `bounds_solid` tells where they go.
    void attach(Group& group, RTCGeometry geometry, std::unique_ptr<Geometry> ours,
                bool bounds_solid = false) {
        if (ours) {
            rtcSetGeometryUserData(geometry, ours.get());
            ours->group = int(&group - m_groups.data());
            ours->partly = is_partly_there(m_store, m_store.shapes()[size_t(ours->shape_of_grid[0])]);
            bounds_solid = ours->solid >= 0;
            if (bounds_solid || ours->partly) {
                const auto filter = bounds_solid ? note_crossing : presence_filter;
                rtcSetGeometryIntersectFilterFunction(geometry, filter);
                rtcSetGeometryOccludedFilterFunction(geometry, filter);
            }
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(bounds_solid && group.solids ? group.solids : group.scene, geometry,
                              unsigned(group.geometries.size()));
        group.geometries.push_back(std::move(ours));
        rtcReleaseGeometry(geometry);
    }

    // Grids of a group that move by the same steps and whose hits are all filtered, or all not: their
    // vertices lie in the store as they are.
    void add_grids(Group& group, const std::vector<int>& shapes, int solid) {
        if (shapes.empty())
            return;
        RTCGeometry geometry = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_GRID);
        size_t last = 0;
        auto* grids = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), shapes.size()));
        for (size_t i = 0; i < shapes.size(); i++) {
            const store::ShapeRecord& s = m_store.shapes()[size_t(shapes[i])];
            const unsigned first = unsigned(s.positions) / 3;
            grids[i] = {first, unsigned(s.mu + 1), uint16_t(s.mu + 1), uint16_t(s.mv + 1)};
            last = std::max(last, size_t(first) + size_t(s.mu + 1) * size_t(s.mv + 1));
        }
        const store::ShapeRecord& first = m_store.shapes()[size_t(shapes[0])]; // all move by the same steps
        rtcSetGeometryTimeStepCount(geometry, unsigned(first.motion_segments) + 1);
        for (int k = 0; k <= first.motion_segments; k++)
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, unsigned(k), RTC_FORMAT_FLOAT3,
                                       m_store.words(first), size_t(k) * size_t(first.motion_stride) * 4, 12,
                                       last);
        auto ours = std::make_unique<Geometry>(Geometry{&m_store, shapes, {}, solid});
        attach(group, geometry, std::move(ours));
    }

    // The same grids as quads that share the grids' vertices; for still ones. Embree splits both along the
    // same diagonal.
    void add_quads(Group& group, const std::vector<int>& shapes, size_t cells, int solid) {
        RTCGeometry geometry = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_QUAD);
        auto* corner = static_cast<uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 16, cells));
        auto ours = std::make_unique<Geometry>(Geometry{&m_store, {}, {}, solid});
        ours->shape_of_grid.reserve(cells);
        ours->cell.reserve(cells);
        size_t last = 0;
        for (int shape : shapes) {
            const store::ShapeRecord& s = m_store.shapes()[size_t(shape)];
            const unsigned first = unsigned(s.positions) / 3, row = unsigned(s.mu + 1);
            for (unsigned j = 0; j < unsigned(s.mv); j++)
                for (unsigned i = 0; i < unsigned(s.mu); i++) {
                    const unsigned at = first + j * row + i;
                    *corner++ = at, *corner++ = at + 1, *corner++ = at + row + 1, *corner++ = at + row;
                    ours->shape_of_grid.push_back(shape);
                    ours->cell.push_back(i | j << 16);
                }
            last = std::max(last, size_t(first) + size_t(row) * size_t(s.mv + 1));
        }
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   m_store.words(m_store.shapes()[size_t(shapes[0])]), 0, 12, last);
        m_bytes += int64_t(cells * 2 * sizeof(int));
        attach(group, geometry, std::move(ours));
    }

    void add_mesh(Group& group, int shape, int solid) {
        const store::ShapeRecord& s = m_store.shapes()[size_t(shape)];
        struct Kind {
            RTCGeometryType type;
            RTCFormat vertex, index;
            size_t vertex_bytes, index_bytes;
        };
        const Kind kind =
            s.flags & store::ShapeRecord::Balls
                ? Kind{RTC_GEOMETRY_TYPE_SPHERE_POINT, RTC_FORMAT_FLOAT4, RTC_FORMAT_UNDEFINED, 16, 0}
            : s.flags & store::ShapeRecord::Fibre
                ? Kind{RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE, RTC_FORMAT_FLOAT4, RTC_FORMAT_UINT, 16, 4}
            : s.flags & store::ShapeRecord::Quads
                ? Kind{RTC_GEOMETRY_TYPE_QUAD, RTC_FORMAT_FLOAT3, RTC_FORMAT_UINT4, 12, 16}
                : Kind{RTC_GEOMETRY_TYPE_TRIANGLE, RTC_FORMAT_FLOAT3, RTC_FORMAT_UINT3, 12, 12};
        RTCGeometry geometry = rtcNewGeometry(m_device, kind.type);
        rtcSetGeometryTimeStepCount(geometry, unsigned(s.motion_segments) + 1);
        for (int k = 0; k <= s.motion_segments; k++)
            rtcSetSharedGeometryBuffer(
                geometry, RTC_BUFFER_TYPE_VERTEX, unsigned(k), kind.vertex, m_store.words(s) + s.positions,
                size_t(k) * size_t(s.motion_stride) * 4, kind.vertex_bytes, size_t(s.mu));
        if (kind.index != RTC_FORMAT_UNDEFINED) // balls are the vertices
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, kind.index,
                                       m_store.words(s) + s.indices, 0, kind.index_bytes, size_t(s.mv));
        attach(group, geometry, std::make_unique<Geometry>(Geometry{&m_store, {shape}, {}, solid}));
    }

    void add_instances(Group& group, const GroupDesc::Instances& desc, const GroupDesc& child) {
        if (desc.paths.empty() && desc.places.empty())
            return;
        auto in = std::make_unique<Instances>();
        const size_t target = target_of(desc, m_whole);
        in->group = int(target);
        in->first_slot = desc.first_slot;
        in->slots = child.slots;
        in->first_emitter = child.emitters > 0 ? child.first_emitter : -1;
        in->target = &m_groups[target];
        in->places = desc.places;
        in->paths = desc.paths;
        in->variations = desc.variations;
        in->levels = desc.levels;
        in->child = box_of(*in->target);
        if (in->paths.empty())
            in->clusters = cluster_instances(in->places, in->child);
        else
            bound_paths(*in);
        const size_t count = in->paths.empty() ? in->clusters.size() : in->paths.size();
        RTCGeometry geometry = rtcNewGeometry(m_device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, unsigned(count));
        rtcSetGeometryTimeStepCount(geometry, unsigned(in->steps));
        rtcSetGeometryUserData(geometry, in.get());
        rtcSetGeometryBoundsFunction(geometry, instance_bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry, instance_intersect);
        rtcSetGeometryOccludedFunction(geometry, instance_occluded);
        m_bytes += int64_t(in->clusters.size() * sizeof(Cluster) + in->bounds.size() * sizeof(Bounds3f));
        group.instances.push_back(std::move(in));
        attach(group, geometry, nullptr, desc.bounds_solid);
    }

    // Embree's tasks are none of ours: it asks by itself.
    void commit(RTCScene scene) {
        if (m_build.cancelled)
            rtcSetSceneProgressMonitorFunction(
                scene, [](void* of, double) { return !static_cast<const Scene::Build*>(of)->cancelled(); },
                &m_build);
        rtcCommitScene(scene);
        rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
        tasks::check_cancelled(); // then it is not built
        const RTCError error = rtcGetDeviceError(m_device);
        if (error == RTC_ERROR_CANCELLED)
            throw tasks::Cancelled();
        if (error == RTC_ERROR_OUT_OF_MEMORY)
            throw Error("there is not enough memory for the structure by which " +
                        std::to_string(m_bytes >> 20) +
                        " MB and more of geometry are traced: a larger shading rate or instances would do");
    }

    RTCDevice m_device;
    const store::Store& m_store;
    const PageScene& m_pages;
    std::vector<Group>& m_groups;
    std::atomic<int64_t>& m_bytes;
    Scene::Build m_build;
    bool m_whole = false; // the group that is being built
};

} // namespace

Scene::Impl::Impl(const store::Store& store) : store(store) {
    device = rtcNewDevice(EmbreeSettings);
    if (!device)
        throw Error("Embree could not start", ExitCode::Internal);
    rtcSetDeviceMemoryMonitorFunction(
        device,
        [](void* user, ssize_t n, bool) {
            static_cast<std::atomic<int64_t>*>(user)->fetch_add(n);
            return true;
        },
        &bytes);
}

Scene::Impl::~Impl() {
    for (Group& g : groups)
        for (RTCScene s : {g.scene, g.solids})
            if (s)
                rtcReleaseScene(s);
    rtcReleaseDevice(device);
}

Scene::Scene(store::Store& store, std::span<const GroupDesc> groups, Build build)
    : m_impl(std::make_unique<Impl>(store)) {
    m_impl->few = FewTriangles::of(store, groups, build.pages_from.few_triangles);
    if (m_impl->few)
        groups = {};
    const auto build_pages = [&](const PagesFrom& from) {
        m_impl->pages = nullptr; // not beside those of before
        m_impl->pages = std::make_unique<PageScene>(store, groups, from, build.page_bytes, build.files,
                                                    build.leftovers.get());
    };
    build_pages(build.pages_from);
    if (build.pages_from.cells > 0 && m_impl->pages->goes_round()) {
        PagesFrom from = build.pages_from;
        from.places = ~uint64_t(0); // whatever their number
        build_pages(from);
    }
    build.leftovers.reset(); // what is left of them is of no use any more
    tasks::check_cancelled();
    m_impl->groups.resize(2 * std::max<size_t>(groups.size(), 1));
    if (m_impl->few)
        return;
    Builder(m_impl->device, store, *m_impl->pages, m_impl->groups, m_impl->bytes, std::move(build))
        .run(groups);
}

Scene::~Scene() = default;

Bounds3f Scene::bounds() const {
    Bounds3f bounds = m_impl->few ? m_impl->few->bounds() : m_impl->pages->bounds();
    if (m_impl->embree().scene)
        bounds.extend(box_of(m_impl->embree()));
    return bounds;
}

uint64_t Scene::bytes() const {
    return uint64_t(std::max<int64_t>(0, m_impl->bytes.load())) + m_impl->pages->bytes() +
           (m_impl->few ? m_impl->few->bytes() : 0);
}

Scene::PageBytes Scene::page_bytes() const {
    return m_impl->pages->bytes_of_shapes();
}

Scene::Kept Scene::kept() const {
    return m_impl->pages->kept();
}

std::shared_ptr<Leftovers> Scene::leave() {
    auto leftovers = std::make_shared<Leftovers>();
    m_impl->pages->leave(*leftovers);
    return leftovers;
}

} // namespace kanuka::bvh
