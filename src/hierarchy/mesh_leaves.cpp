#include "hierarchy/mesh_leaves.h"

#include <algorithm>

#include "base/error.h"
#include "base/tasks.h"

namespace kanuka::hierarchy {

namespace {

constexpr size_t FacesATask = 4096;
constexpr uint32_t LeavesAGroup = 8;

bool corners_of_triangle(const MeshView& m, size_t triangle, Vec3f (&to)[3]) {
    static constexpr size_t Quad[2][3] = {{0, 1, 3}, {2, 3, 1}};
    for (size_t c = 0; c < 3; c++) {
        const uint32_t vertex =
            m.sides == 3 ? m.corners[3 * triangle + c] : m.corners[triangle / 2 * 4 + Quad[triangle % 2][c]];
        if (vertex >= m.vertices)
            return false;
        const float* p = m.positions + 3 * size_t(vertex);
        to[c] = {p[0], p[1], p[2]};
        if (!is_somewhere(to[c]))
            return false;
    }
    return true;
}

} // namespace

MeshLeaves::MeshLeaves(std::span<const MeshView> meshes, const Lattice& lattice)
    : m_meshes(meshes), m_lattice(lattice) {
    uint64_t faces = 0;
    for (const MeshView& m : meshes) {
        m_first.push_back(faces);
        faces += m.triangles();
    }
    if (faces >= uint64_t(1) << 31)
        throw Error("a page of the ray tracer has 2^31 triangles or more");
    std::vector<Item> items(faces);
    std::vector<uint8_t> is_there(faces);
    tasks::parallel_chunks(faces, FacesATask, [&](size_t begin, size_t end) {
        for (size_t f = begin; f < end; f++) {
            Corners c;
            if (!find(uint32_t(f), c))
                continue;
            Bounds3f box;
            for (const Vec3f& p : c.at)
                box.extend(p);
            items[f] = Item(box, uint32_t(f));
            is_there[f] = 1;
        }
    });
    size_t kept = 0;
    for (size_t f = 0; f < faces; f++)
        if (is_there[f])
            items[kept++] = items[f];
    items.resize(kept);

    // The largest parts of the tree that have eight leaves or fewer become groups.
    const SplitTree tree = split_all(std::move(items), LeafTriangles);
    m_faces.resize(kept);
    for (size_t i = 0; i < kept; i++)
        m_faces[i] = tree.items[i].index;
    std::vector<int32_t> todo;
    if (!tree.branches.empty())
        todo.push_back(0);
    while (!todo.empty()) {
        const int32_t b = todo.back();
        todo.pop_back();
        const SplitTree::Branch& branch = tree.branches[size_t(b)];
        if (branch.leaves > LeavesAGroup) {
            todo.push_back(branch.right), todo.push_back(branch.left);
            continue;
        }
        Group group{Kind::Triangle32, 0};
        group.source = uint32_t(m_leaves.size());
        collect(tree, b, group);
        m_groups.push_back(group);
    }
    tasks::parallel_chunks(m_groups.size(), FacesATask / 64, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++)
            m_groups[g].kind = kind_of_group(m_groups[g]);
    });
}

void MeshLeaves::collect(const SplitTree& tree, int32_t branch, Group& group) {
    const SplitTree::Branch& b = tree.branches[size_t(branch)];
    if (b.left < 0) {
        group.box[group.count++] = b.box;
        m_leaves.push_back({b.begin, b.end});
        return;
    }
    collect(tree, b.left, group);
    collect(tree, b.right, group);
}

// The least of the kinds that hold all its leaves.
Kind MeshLeaves::kind_of_group(const Group& group) const {
    Kind kind = Kind::Triangle32;
    for (int i = 0; i < group.count; i++) {
        const Frame frame(m_lattice, points(m_leaves[group.source + size_t(i)]).at);
        if (frame.fields() >= 0)
            continue;
        if (!frame.holds_48())
            return Kind::TriangleFloat;
        kind = Kind::Triangle48;
    }
    return kind;
}

bool MeshLeaves::find(uint32_t face, Corners& to) const {
    const size_t mesh =
        size_t(std::upper_bound(m_first.begin(), m_first.end(), uint64_t(face)) - m_first.begin()) - 1;
    if (!corners_of_triangle(m_meshes[mesh], size_t(face - m_first[mesh]), to.at))
        return false;
    for (Vec3f& p : to.at)
        p = m_lattice.snap(p);
    return true;
}

MeshLeaves::Points MeshLeaves::points(const Leaf& leaf) const {
    Points p;
    p.count = leaf.end - leaf.begin;
    for (uint32_t k = 0; k < uint32_t(LeafTriangles); k++) {
        Corners c;
        find(m_faces[leaf.begin + std::min(k, p.count - 1)], c);
        for (int corner = 0; corner < 3; corner++)
            p.at[corner * LeafTriangles + int(k)] = c.at[corner];
    }
    return p;
}

void MeshLeaves::write(const Group& group, int i, uint8_t* to) const {
    const Points p = points(m_leaves[group.source + size_t(i)]);
    if (group.kind == Kind::TriangleFloat) {
        TriangleFloat& leaf = *reinterpret_cast<TriangleFloat*>(to);
        for (int a = 0; a < 3; a++)
            for (int corner = 0; corner < 3; corner++)
                for (int k = 0; k < LeafTriangles; k++)
                    leaf.coordinate[a][corner][k] = p.at[corner * LeafTriangles + k][a];
        leaf.count = p.count;
        return;
    }
    const Frame frame(m_lattice, p.at);
    if (group.kind == Kind::Triangle48) {
        Triangle48& leaf = *reinterpret_cast<Triangle48*>(to);
        for (int a = 0; a < 3; a++)
            for (int corner = 0; corner < 3; corner++)
                for (int k = 0; k < LeafTriangles; k++)
                    leaf.coordinate[a][corner][k] =
                        uint16_t(frame.field(p.at[corner * LeafTriangles + k], a));
        frame.write(leaf.frame, -1, p.count);
        return;
    }
    Triangle32& leaf = *reinterpret_cast<Triangle32*>(to);
    const int fields = frame.fields();
    for (int corner = 0; corner < 3; corner++)
        for (int k = 0; k < LeafTriangles; k++)
            leaf.corner[corner][k] = frame.pack(p.at[corner * LeafTriangles + k], fields);
    frame.write(leaf.frame, fields, p.count);
}

void MeshLeaves::names(const Group& group, int i, uint32_t (&to)[LeafTriangles]) const {
    const Leaf& leaf = m_leaves[group.source + size_t(i)];
    for (uint32_t k = 0; k < uint32_t(LeafTriangles); k++)
        to[k] = m_faces[std::min(leaf.begin + k, leaf.end - 1)];
}

// Leaves are not known yet. They are about twice as wide as their triangles.
void MeshLeaves::vote(const MeshView& mesh, size_t face, bool fine, StepVotes& votes) {
    Vec3f corner[3];
    if (!corners_of_triangle(mesh, face, corner))
        return;
    Bounds3f box;
    for (const Vec3f& p : corner)
        box.extend(p);
    if (fine)
        votes.add_fine(box.diagonal() * 2.0f);
    else
        votes.add(box.diagonal() * 2.0f);
}

} // namespace kanuka::hierarchy
