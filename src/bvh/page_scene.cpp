#include "bvh/page_scene.h"

#include <algorithm>

#include "base/tasks.h"

namespace kanuka::bvh {

namespace {

constexpr size_t ShapesATask = 64;

bool is_mesh(const store::ShapeRecord& s) {
    return s.flags & store::ShapeRecord::Mesh;
}
const float* positions_of(const store::Store& store, const store::ShapeRecord& s) {
    return store.floats(s) + s.positions;
}
hierarchy::GridView grid_view(const store::Store& store, const store::ShapeRecord& s) {
    return {positions_of(store, s), s.mu, s.mv};
}
hierarchy::MeshView mesh_view(const store::Store& store, const store::ShapeRecord& s) {
    return {positions_of(store, s), size_t(s.mu), store.words(s) + s.indices, size_t(s.mv),
            s.flags & store::ShapeRecord::Quads ? 4 : 3};
}

// Which groups are reached from the world by instances that stand still.
std::vector<bool> still_groups(std::span<const GroupDesc> groups) {
    std::vector<bool> reached(groups.size());
    reached.back() = true;
    for (size_t g = groups.size(); g-- > 0;)
        if (reached[g])
            for (const auto& in : groups[g].instances)
                if (in.stands_still())
                    reached[size_t(in.group)] = true;
    return reached;
}

} // namespace

PageScene::PageScene(store::Store& store, std::span<const GroupDesc> groups)
    : m_store(store), m_groups(groups.size()) {
    if (groups.empty())
        return;
    const std::vector<bool> reached = still_groups(groups);
    for (size_t g = 0; g < groups.size(); g++)
        if (reached[g])
            build_group(store, groups, g);
    m_root = m_groups.back().root;
}

void PageScene::build_group(store::Store& store, std::span<const GroupDesc> descs, size_t g) {
    const GroupDesc& desc = descs[g];
    Group& group = m_groups[g];
    group.first_emitter = desc.emitters > 0 ? desc.first_emitter : -1;
    group.slots = desc.slots;
    const SolidTrees trees(desc.solids);
    std::vector<int> shapes;
    for (const auto& range : desc.shapes)
        for (int s = range.first; s < range.first + range.count; s++)
            if (can_hold(store.shapes()[size_t(s)], trees.bounded_by(range.solid)))
                shapes.push_back(s);
    if (!shapes.empty())
        build_own(store, group, shapes);

    std::vector<hierarchy::Placements> level;
    if (group.own != None)
        level.push_back({group.own, {}});
    uint32_t count = uint32_t(level.size());
    for (const auto& in : desc.instances) {
        const uint32_t root = m_groups[size_t(in.group)].root;
        if (!in.stands_still() || root == None || in.transforms.empty())
            continue;
        level.push_back({root, in.transforms});
        group.runs.push_back({count, in.group, in.transforms, in.first_slot});
        count += uint32_t(in.transforms.size() / 12);
    }
    group.root = group.runs.empty() ? group.own : m_world.add(level);
    m_group_of_page.resize(m_world.pages().size(), -1);
    if (group.own != None)
        m_group_of_page[group.own] = int(g);
}

void PageScene::build_own(store::Store& store, Group& group, const std::vector<int>& shapes) {
    uint64_t triangles = 0;
    for (const int shape : shapes) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        const bool mesh = is_mesh(s), partly = is_partly_there(store, s);
        (mesh ? group.meshes : group.grids).push_back(shape);
        (mesh ? group.partly_meshes : group.partly_grids).push_back(partly);
        m_partly |= partly;
        if (!mesh)
            continue;
        group.first_triangle.push_back(uint32_t(triangles));
        triangles += mesh_view(store, s).triangles();
    }
    std::vector<hierarchy::GridView> grids;
    std::vector<hierarchy::MeshView> meshes;
    for (const int shape : group.grids)
        grids.push_back(grid_view(store, store.shapes()[size_t(shape)]));
    for (const int shape : group.meshes)
        meshes.push_back(mesh_view(store, store.shapes()[size_t(shape)]));
    const hierarchy::Lattice of_grids = hierarchy::votes_of({grids, {}}).lattice(),
                             of_meshes = hierarchy::votes_of({{}, meshes, true}).lattice();
    // What is shaded and what lights are sampled on is what is hit.
    tasks::parallel_chunks(shapes.size(), ShapesATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const bool mesh = is_mesh(store.shapes()[size_t(shapes[i])]);
            store.move_vertices(shapes[i], [&lattice = mesh ? of_meshes : of_grids](const Vec3f& p) {
                return hierarchy::is_somewhere(p) ? lattice.snap(p) : p;
            });
        }
    });
    m_memory.push_back(hierarchy::build({grids, meshes}, of_grids, of_meshes));
    if (m_memory.back().page().header().root == hierarchy::NoRef)
        m_memory.pop_back(); // all of it is nowhere
    else
        group.own = m_world.add(m_memory.back().page());
}

Bounds3f PageScene::bounds() const {
    return empty() ? Bounds3f() : m_world.page(m_root).bounds();
}

uint64_t PageScene::bytes() const {
    uint64_t bytes = m_world.level_bytes();
    for (const hierarchy::PageMemory& m : m_memory)
        bytes += m.size();
    return bytes;
}

} // namespace kanuka::bvh
