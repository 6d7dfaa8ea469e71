#include "hierarchy/mesh_leaves.h"

#include <algorithm>

#include "base/error.h"
#include "base/tasks.h"

namespace kanuka::hierarchy {

namespace {

constexpr size_t FacesATask = 4096;

} // namespace

bool corners_of_triangle(const MeshView& m, size_t triangle, int end, Vec3f (&to)[3]) {
    static constexpr size_t Quad[2][3] = {{0, 1, 3}, {2, 3, 1}};
    for (size_t c = 0; c < 3; c++) {
        const uint32_t vertex =
            m.sides == 3 ? m.corners[3 * triangle + c] : m.corners[triangle / 2 * 4 + Quad[triangle % 2][c]];
        if (vertex >= m.vertices)
            return false;
        const float* p = (end == 0 ? m.positions : m.later) + 3 * size_t(vertex);
        to[c] = {p[0], p[1], p[2]};
        if (!is_somewhere(to[c]))
            return false;
    }
    return true;
}

MeshLeaves::MeshLeaves(std::span<const MeshView> meshes, int sides, const Lattice& lattice,
                       const Lattice& of_grids)
    : m_meshes(meshes), m_lattice(lattice), m_of_grids(of_grids), m_each(uint32_t(sides) - 2),
      m_ends(!meshes.empty() && meshes[0].later ? 2 : 1) {
    uint64_t triangles = 0, faces = 0;
    std::vector<uint64_t> first_face; // among those of so many sides
    bool grids = false, others = false;
    for (const MeshView& m : meshes) {
        (m.is_grid ? grids : others) = true;
        m_first.push_back(triangles), first_face.push_back(faces);
        triangles += m.triangles();
        faces += m.sides == sides ? m.faces : 0;
    }
    m_finest = grids && (!others || of_grids.exponent < lattice.exponent) ? of_grids : lattice;
    if (triangles >= uint64_t(1) << 31)
        throw Error("a page of the ray tracer has 2^31 triangles or more");
    LargeVector<Item> items(faces);
    LargeVector<uint8_t> present(faces);
    tasks::parallel_chunks(faces, FacesATask, [&](size_t begin, size_t end) {
        // Of several meshes that begin at one face the last has it.
        size_t mesh =
            size_t(std::upper_bound(first_face.begin(), first_face.end(), begin) - first_face.begin()) - 1;
        for (size_t f = begin; f < end; f++) {
            while (mesh + 1 < first_face.size() && first_face[mesh + 1] <= f)
                mesh++;
            const uint32_t triangle = uint32_t(m_first[mesh] + (f - first_face[mesh]) * m_each);
            Bounds3f box[2];
            for (uint32_t k = 0; k < m_each; k++) {
                Corners c[2];
                if (!find(triangle + k, 0, c[0]) || (m_ends == 2 && !find(triangle + k, 1, c[1])))
                    continue;
                present[f] = 1;
                for (int end = 0; end < m_ends; end++)
                    for (const Vec3f& p : c[end].at)
                        box[end].extend(p);
            }
            items[f] = Item(m_ends == 1 ? box[0] : halfway(box[0], box[1]), triangle);
        }
    });
    size_t kept = 0;
    for (size_t f = 0; f < faces; f++)
        if (present[f])
            items[kept++] = items[f];
    items.resize(kept);

    m_leaves.make(std::move(items), uint32_t(LeafTriangles) / m_each, Kind::Triangle32);
    LargeVector<Group>& made = m_leaves.groups;
    tasks::parallel_chunks(made.size(), FacesATask / 64, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++)
            made[g].kind = kind_of_group(made[g]);
    });
}

// The least of the kinds that hold all its leaves. Near the origin, where one step is all points', boxes
// tell.
Kind MeshLeaves::kind_of_group(const Group& group) const {
    Kind kind = Kind::Triangle32;
    for (int k = 0; k < group.count * m_ends; k++) {
        const int i = k / m_ends;
        const Vec3f box[2] = {group.box[i].lo, group.box[i].hi};
        const bool near = m_ends == 1 && m_finest.exponent_at(box[0]) == m_finest.exponent &&
                          m_finest.exponent_at(box[1]) == m_finest.exponent;
        const Frame frame =
            near ? Frame(m_finest, box) : Frame(m_finest, points(m_leaves.leaf(group, i), k % m_ends).at);
        if (frame.fields() >= 0)
            continue;
        if (!frame.holds_48())
            return Kind::TriangleFloat;
        kind = Kind::Triangle48;
    }
    return kind;
}

size_t MeshLeaves::mesh_of(uint32_t triangle) const {
    return size_t(std::upper_bound(m_first.begin(), m_first.end(), uint64_t(triangle)) - m_first.begin()) - 1;
}

bool MeshLeaves::find(uint32_t triangle, int end, Corners& to) const {
    const size_t mesh = m_first.size() == 1 ? 0 : mesh_of(triangle);
    if (!corners_of_triangle(m_meshes[mesh], size_t(triangle - m_first[mesh]), end, to.at))
        return false;
    const Lattice& lattice = m_meshes[mesh].is_grid ? m_of_grids : m_lattice;
    for (Vec3f& p : to.at)
        p = lattice.snap(p);
    return true;
}

// Triangle k of a leaf, whose last is repeated. Of a quad one may be nowhere: then it is the other.
uint32_t MeshLeaves::triangle(const LeafGroups::Leaf& leaf, uint32_t k) const {
    k = std::min(k, (leaf.end - leaf.begin) * m_each - 1);
    const uint32_t first = m_leaves.items[leaf.begin + k / m_each], number = first + k % m_each;
    return m_each == 1 || is_there(number) ? number : 2 * first + 1 - number;
}

bool MeshLeaves::is_there(uint32_t triangle) const {
    Corners corners;
    return find(triangle, 0, corners) && (m_ends == 1 || find(triangle, 1, corners));
}

Bounds3f MeshLeaves::box(const Group& group, int i, int end) const {
    Bounds3f box;
    for (const Vec3f& p : points(m_leaves.leaf(group, i), end).at)
        box.extend(p);
    return box;
}

MeshLeaves::Points MeshLeaves::points(const LeafGroups::Leaf& leaf, int end) const {
    Points p;
    p.count = (leaf.end - leaf.begin) * m_each;
    for (uint32_t k = 0; k < uint32_t(LeafTriangles); k++) {
        Corners c;
        find(triangle(leaf, k), end, c);
        for (int corner = 0; corner < 3; corner++)
            p.at[corner * LeafTriangles + int(k)] = c.at[corner];
    }
    return p;
}

void MeshLeaves::write(const Group& group, int i, uint8_t* to, int end) const {
    const Points p = points(m_leaves.leaf(group, i), end);
    if (group.kind == Kind::TriangleFloat) {
        TriangleFloat& leaf = *reinterpret_cast<TriangleFloat*>(to);
        for (int a = 0; a < 3; a++)
            for (int corner = 0; corner < 3; corner++)
                for (int k = 0; k < LeafTriangles; k++)
                    leaf.coordinate[a][corner][k] = p.at[corner * LeafTriangles + k][a];
        leaf.count = p.count;
        return;
    }
    const Frame frame(m_finest, p.at);
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
    const LeafGroups::Leaf& leaf = m_leaves.leaf(group, i);
    for (uint32_t k = 0; k < uint32_t(LeafTriangles); k++)
        to[k] = triangle(leaf, k);
}

// Leaves are not known yet. They are about twice as wide as their triangles.
void MeshLeaves::vote(const MeshView& mesh, size_t triangle, bool fine, StepVotes& votes) {
    Vec3f corner[3];
    if (!corners_of_triangle(mesh, triangle, 0, corner))
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
