#include "hierarchy/fibre_leaves.h"

#include <algorithm>

#include "base/error.h"
#include "base/tasks.h"

namespace kanuka::hierarchy {

namespace {

constexpr size_t SegmentsATask = 4096;

Bounds3f box_of(const Vec3f (&end)[2], const float (&radius)[2]) {
    Bounds3f box;
    for (int e = 0; e < 2; e++)
        box.extend(end[e] - Vec3f(radius[e])), box.extend(end[e] + Vec3f(radius[e]));
    return box;
}

} // namespace

void FibreVotes::add(const Vec3f& leaf_extent, float radius) {
    m_steps.add(leaf_extent);
    m_largest = std::max(m_largest, radius);
    if (radius > 0)
        m_radii[size_t(exponent_of(radius) + 127)]++;
}

void FibreVotes::add(const FibreVotes& other) {
    m_steps.add(other.m_steps);
    m_largest = std::max(m_largest, other.m_largest);
    for (size_t i = 0; i < m_radii.size(); i++)
        m_radii[i] += other.m_radii[i];
}

FibreLattice FibreVotes::lattice() const {
    uint64_t all = 0, finer = 0;
    for (const uint64_t n : m_radii)
        all += n;
    Lattice lattice = m_steps.lattice();
    for (size_t i = 0; i < m_radii.size() && all > 0; i++)
        if ((finer += m_radii[i]) * 10 > all) {
            lattice.exponent = std::clamp(int(i) - 127 - 1, int(Lattice::LeastExponent), lattice.exponent);
            break;
        }
    return FibreLattice::of(lattice, m_largest);
}

FibreLeaves::FibreLeaves(std::span<const FibreView> fibres, const FibreLattice& lattice)
    : m_fibres(fibres), m_lattice(lattice), m_ends(!fibres.empty() && fibres[0].later ? 2 : 1) {
    uint64_t segments = 0;
    for (const FibreView& f : fibres) {
        m_first.push_back(segments);
        segments += f.segments;
    }
    if (segments >= uint64_t(1) << 31)
        throw Error("a page of the ray tracer has 2^31 segments of fibres or more");
    LargeVector<Item> items(segments);
    LargeVector<uint8_t> is_there(segments);
    tasks::parallel_chunks(segments, SegmentsATask, [&](size_t begin, size_t end) {
        for (size_t s = begin; s < end; s++) {
            const size_t f = fibre_of(uint32_t(s));
            Segment there[2];
            if (!find(m_fibres[f], s - m_first[f], 0, there[0]) ||
                (m_ends == 2 && !find(m_fibres[f], s - m_first[f], 1, there[1])))
                continue;
            is_there[s] = 1;
            Bounds3f box[2];
            for (int end = 0; end < m_ends; end++) {
                const Segment on = on_lattice(there[end]);
                box[end] = box_of(on.end, on.radius);
            }
            items[s] = Item(m_ends == 1 ? box[0] : halfway(box[0], box[1]), uint32_t(s));
        }
    });
    size_t kept = 0;
    for (size_t s = 0; s < segments; s++)
        if (is_there[s])
            items[kept++] = items[s];
    items.resize(kept);
    m_leaves.make(std::move(items), LeafSegments, Kind::Fibre32);
    LargeVector<Group>& made = m_leaves.groups;
    tasks::parallel_chunks(made.size(), SegmentsATask / 64, [&](size_t begin, size_t end) {
        for (size_t g = begin; g < end; g++)
            made[g].kind = kind_of_group(made[g]);
    });
}

size_t FibreLeaves::fibre_of(uint32_t segment) const {
    return size_t(std::upper_bound(m_first.begin(), m_first.end(), uint64_t(segment)) - m_first.begin()) - 1;
}

bool FibreLeaves::find(const FibreView& fibre, size_t segment, int end, Segment& to) {
    const size_t first = fibre.first[segment], last = first + (fibre.balls ? 0 : 1);
    if (last >= fibre.count)
        return false;
    for (size_t e = 0; e < 2; e++) {
        const float* p = (end == 0 ? fibre.vertices : fibre.later) + 4 * (e == 0 ? first : last);
        to.end[e] = {p[0], p[1], p[2]}, to.radius[e] = p[3];
        if (!is_somewhere(to.end[e]) || !(abs(p[3]) < LargestCoordinate))
            return false;
    }
    return true;
}

FibreLeaves::Segment FibreLeaves::on_lattice(const Segment& s) const {
    Segment on;
    for (int e = 0; e < 2; e++) {
        on.end[e] = m_lattice.places.snap(s.end[e]);
        on.radius[e] = m_lattice.radius(m_lattice.word(s.radius[e]));
    }
    return on;
}

uint32_t FibreLeaves::number(const LeafGroups::Leaf& leaf, uint32_t k) const {
    return m_leaves.items[std::min(leaf.begin + k, leaf.end - 1)];
}

FibreLeaves::Segment FibreLeaves::found(uint32_t segment, int end) const {
    const size_t f = fibre_of(segment);
    Segment s;
    find(m_fibres[f], segment - m_first[f], end, s);
    return on_lattice(s);
}

Bounds3f FibreLeaves::box(const Group& group, int i, int end) const {
    const LeafGroups::Leaf& leaf = m_leaves.leaf(group, i);
    Bounds3f box;
    for (uint32_t k = 0; k < leaf.end - leaf.begin; k++) {
        const Segment s = found(number(leaf, k), end);
        box.extend(box_of(s.end, s.radius));
    }
    return box;
}

FibreLeaves::Points FibreLeaves::points(const LeafGroups::Leaf& leaf, int end) const {
    Points p;
    p.count = leaf.end - leaf.begin;
    for (uint32_t k = 0; k < uint32_t(LeafSegments); k++) {
        const Segment s = found(number(leaf, k), end);
        for (uint32_t e = 0; e < 2; e++) {
            p.at[e * LeafSegments + k] = s.end[e];
            p.radius[e][k] = m_lattice.word(s.radius[e]);
        }
    }
    return p;
}

// The least of the kinds that hold all its leaves. Near the origin, where one step is all points', boxes tell
// of most.
Kind FibreLeaves::kind_of_group(const Group& group) const {
    const Lattice& lattice = m_lattice.places;
    Kind kind = Kind::Fibre32;
    for (int k = 0; k < group.count * m_ends; k++) {
        const int i = k / m_ends;
        const Vec3f box[2] = {group.box[i].lo, group.box[i].hi},
                    on_it[2] = {lattice.snap(box[0]), lattice.snap(box[1])};
        if (m_ends == 1 && lattice.exponent_at(on_it[0]) == lattice.exponent &&
            lattice.exponent_at(on_it[1]) == lattice.exponent && Frame(lattice, on_it).fields() >= 0)
            continue;
        const Frame frame(m_lattice.places, points(m_leaves.leaf(group, i), k % m_ends).at);
        if (frame.fields() >= 0)
            continue;
        if (!frame.holds_48())
            return Kind::FibreFloat;
        kind = Kind::Fibre48;
    }
    return kind;
}

void FibreLeaves::write(const Group& group, int i, uint8_t* to, int end) const {
    const Points p = points(m_leaves.leaf(group, i), end);
    const auto write_radii = [&](auto& leaf) {
        std::copy_n(p.radius[0], 2 * LeafSegments, leaf.radius[0]);
        leaf.least_radius = m_lattice.least_radius;
    };
    if (group.kind == Kind::FibreFloat) {
        FibreFloat& leaf = *reinterpret_cast<FibreFloat*>(to);
        for (int a = 0; a < 3; a++)
            for (int e = 0; e < 2; e++)
                for (int k = 0; k < LeafSegments; k++)
                    leaf.coordinate[a][e][k] = p.at[e * LeafSegments + k][a];
        leaf.count = p.count;
        return write_radii(leaf);
    }
    const Frame frame(m_lattice.places, p.at);
    if (group.kind == Kind::Fibre48) {
        Fibre48& leaf = *reinterpret_cast<Fibre48*>(to);
        for (int a = 0; a < 3; a++)
            for (int e = 0; e < 2; e++)
                for (int k = 0; k < LeafSegments; k++)
                    leaf.coordinate[a][e][k] = uint16_t(frame.field(p.at[e * LeafSegments + k], a));
        frame.write(leaf.frame, -1, p.count);
        return write_radii(leaf);
    }
    Fibre32& leaf = *reinterpret_cast<Fibre32*>(to);
    const int fields = frame.fields();
    for (int e = 0; e < 2; e++)
        for (int k = 0; k < LeafSegments; k++)
            leaf.end[e][k] = frame.pack(p.at[e * LeafSegments + k], fields);
    frame.write(leaf.frame, fields, p.count);
    write_radii(leaf);
}

void FibreLeaves::names(const Group& group, int i, uint32_t (&to)[LeafSegments]) const {
    for (uint32_t k = 0; k < uint32_t(LeafSegments); k++)
        to[k] = number(m_leaves.leaf(group, i), k);
}

// Leaves are not known yet: of segments side by side they are about as long as those and half as wide.
void FibreLeaves::vote(const FibreView& fibre, size_t segment, FibreVotes& votes) {
    Segment s;
    if (!find(fibre, segment, 0, s))
        return;
    Bounds3f box;
    for (const Vec3f& p : s.end)
        box.extend(p);
    const Vec3f size = box.diagonal();
    votes.add(size + Vec3f(0.5f * max(max(size.x, size.y), size.z)), max(s.radius[0], s.radius[1]));
}

} // namespace kanuka::hierarchy
