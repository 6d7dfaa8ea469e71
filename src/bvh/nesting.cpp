#include "bvh/nesting.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <unordered_set>

#include "base/lanes.h"
#include "base/tasks.h"
#include "bvh/boxes.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {
namespace {

bool is_still(const GroupDesc::Instances& in) {
    return in.paths.empty() && !in.bounds_solid;
}

// The matrix of one of them, as it is.
void append(std::vector<float>& matrices, const Places& places, size_t i) {
    const auto one = places.matrices.subspan(12 * places.number(i), 12);
    matrices.insert(matrices.end(), one.begin(), one.end());
}

// Of those that are kept, by number.
template <class T>
void keep(std::vector<T>& all, const std::vector<size_t>& kept) {
    if (all.empty())
        return;
    std::vector<T> of_kept;
    for (const size_t i : kept)
        of_kept.push_back(all[i]);
    all = std::move(of_kept);
}
void keep_places(GroupDesc::Instances& in, const std::vector<size_t>& kept,
                 std::vector<std::vector<float>>& room) {
    std::vector<float> matrices;
    for (const size_t i : kept)
        append(matrices, in.places, i);
    room.push_back(std::move(matrices));
    in.places.matrices = room.back(), in.places.which = {};
    keep(in.variations, kept);
    keep(in.levels, kept);
}

// ---- copies in one place

struct Placement {
    int group;
    std::array<uint32_t, 12> bits;
    bool operator==(const Placement&) const = default;
};
struct Hash {
    size_t operator()(const Placement& p) const {
        uint64_t h = uint64_t(uint32_t(p.group)) * 0x9e3779b97f4a7c15ull;
        for (const uint32_t b : p.bits)
            h = (h ^ b) * 0x100000001b3ull; // FNV-1a, a word at a time
        return size_t(h ^ h >> 32);
    }
};

// They look like one: hits at one distance on one shape are decided alike. Light is asked of one of them.
uint64_t merge_copies(GroupDesc& group, std::vector<std::vector<float>>& room) {
    constexpr size_t MostCompared = 1 << 16; // more are a crowd that lies apart, or are left out below
    uint64_t merged = 0;
    size_t all = 0;
    for (const auto& in : group.instances)
        all += in.size();
    if (all > MostCompared)
        return 0;
    std::unordered_set<Placement, Hash> seen;
    for (auto& in : group.instances) {
        if (!is_still(in))
            continue;
        std::vector<size_t> kept;
        for (size_t i = 0; i < in.places.size(); i++)
            if (seen.insert({in.group, std::bit_cast<std::array<uint32_t, 12>>(in.places[i])}).second)
                kept.push_back(i);
        if (kept.size() == in.places.size())
            continue;
        merged += in.places.size() - kept.size();
        if (kept.empty())
            in.places = {};
        else
            keep_places(in, kept, room);
    }
    std::erase_if(group.instances, [](const auto& in) { return is_still(in) && in.places.empty(); });
    return merged;
}

// ---- chains

// A group that is nothing but one still instance of another one.
bool is_link(const GroupDesc& g) {
    return g.shapes.empty() && g.solids.empty() && g.instances.size() == 1 && is_still(g.instances[0]) &&
           g.instances[0].places.size() == 1 && g.instances[0].levels.empty();
}

// Instances of links become instances of what those place. Lower groups come first, so a link names none.
void join_chains(std::span<const GroupDesc> groups, GroupDesc& group, std::vector<std::vector<float>>& room) {
    for (auto& in : group.instances) {
        const GroupDesc& link = groups[size_t(in.group)];
        if (!is_still(in) || !is_link(link))
            continue;
        const Matrix inner = link.instances[0].places[0];
        std::vector<float> t(12 * in.places.size());
        for (size_t i = 0; i < in.places.size(); i++) {
            const Matrix outer = in.places[i];
            for (size_t r = 0; r < 3; r++)
                for (size_t c = 0; c < 4; c++) {
                    double sum = c == 3 ? double(outer[4 * r + 3]) : 0;
                    for (size_t k = 0; k < 3; k++)
                        sum += double(outer[4 * r + k]) * double(inner[4 * k + c]);
                    t[12 * i + 4 * r + c] = float(sum);
                }
        }
        room.push_back(std::move(t));
        in.places = room.back();
        in.group = link.instances[0].group;
        if (const auto& inner_ones = link.instances[0].variations; !inner_ones.empty() && inner_ones[0] != 0)
            in.variations.assign(in.places.size(), inner_ones[0]);
    }
}

// ---- what overlaps

Bounds3f bounds_of(const store::Store& store, const store::ShapeRecord& s) {
    const bool mesh = s.flags & store::ShapeRecord::Mesh, fibre = s.flags & store::ShapeRecord::Fibre;
    const size_t n = mesh ? size_t(s.mu) : size_t(s.mu + 1) * size_t(s.mv + 1), each = fibre ? 4 : 3;
    Bounds3f b;
    for (int k = 0; k <= s.motion_segments; k++) {
        const uint32_t* words = store.words(s) + size_t(s.positions) + size_t(k) * size_t(s.motion_stride);
        for (size_t i = 0; i < n; i++, words += each) {
            float p[4] = {};
            std::memcpy(p, words, each * sizeof(float));
            if (!std::isfinite(p[0] + p[1] + p[2] + p[3]))
                continue;
            b.extend(Vec3f(p[0], p[1], p[2]) - Vec3f(p[3]));
            b.extend(Vec3f(p[0], p[1], p[2]) + Vec3f(p[3]));
        }
    }
    return b;
}

Bounds3f box_of(const GroupDesc::Instances& in, size_t i, const Bounds3f& child) {
    if (in.paths.empty())
        return placed(in.places[i].data(), child);
    Bounds3f b;
    for (const double time : {0.0, 0.5, 1.0}) {
        float m[12];
        in.paths[i].at(time, m);
        if (const Bounds3f there = placed(m, child); !there.empty())
            b.extend(there);
    }
    return b;
}

// Places at which to look how many instances overlap.
class Spots {
  public:
    static constexpr int Most = 64;
    Spots() {
        for (int a = 0; a < 3; a++) { // those that are none overlap with nothing
            std::fill_n(m_lo[a], Most, std::numeric_limits<float>::infinity());
            std::fill_n(m_hi[a], Most, -std::numeric_limits<float>::infinity());
        }
    }
    void add(const Bounds3f& box) {
        for (int a = 0; a < 3; a++)
            m_lo[a][m_count] = box.lo[a], m_hi[a][m_count] = box.hi[a];
        m_areas[m_count++] = half_area(box);
    }

    // visit(spot, share) for those that overlap with the box: of the rays that meet the spot, those that meet
    // the box too, by the surface area heuristic.
    template <class Visit>
    void overlapping(const Bounds3f& box, const Visit& visit) const {
        if (box.empty())
            return;
        for (int first = 0; first < m_count; first += 8) {
            Mask<8> overlap(true);
            for (int a = 0; a < 3; a++)
                overlap &= (Float<8>::load(m_lo[a] + first) <= Float<8>(box.hi[a])) &
                           (Float<8>::load(m_hi[a] + first) >= Float<8>(box.lo[a]));
            for (uint32_t bits = overlap.bits(); bits != 0; bits &= bits - 1) {
                const int k = first + std::countr_zero(bits);
                Bounds3f both;
                for (int a = 0; a < 3; a++) {
                    both.lo[a] = std::max(m_lo[a][k], box.lo[a]);
                    both.hi[a] = std::min(m_hi[a][k], box.hi[a]);
                }
                visit(k, m_areas[k] > 0 ? std::min(1.0, half_area(both) / m_areas[k]) : 1);
            }
        }
    }

  private:
    int m_count = 0;
    float m_lo[3][Most], m_hi[3][Most];
    double m_areas[Most];
};

// What is known of a group once those below it are done.
struct Level {
    Bounds3f bounds;
    double entered = 0;
    int depth = 0; // of instances in it
};

class Bounding {
  public:
    Bounding(const store::Store& store, std::span<GroupDesc> groups, std::vector<std::vector<float>>& room,
             double most)
        : m_store(store), m_groups(groups), m_room(room), m_most(most), m_levels(groups.size()) {}

    void bound(size_t g, Nesting& out) {
        GroupDesc& group = m_groups[g];
        Level& level = m_levels[g];
        for (const auto& range : group.shapes)
            for (int s = range.first; s < range.first + range.count; s++)
                if (const Bounds3f b = bounds_of(m_store, m_store.shapes()[size_t(s)]); !b.empty())
                    level.bounds.extend(b);
        for (auto& in : group.instances)
            if (m_levels[size_t(in.group)].depth + 1 > MaxDepth) {
                out.too_deep += in.size();
                in.places = {}, in.paths = {};
            }
        std::erase_if(group.instances, [](const auto& in) { return in.size() == 0; });
        for (const auto& in : group.instances)
            level.depth = std::max(level.depth, m_levels[size_t(in.group)].depth + 1);
        const Spots spots = spots_of(group);
        Sums sums{};
        Bounds3f bounds;
        for (const auto& in : group.instances)
            add(in, spots, sums, bounds);
        if (std::any_of(sums.begin(), sums.end(), [&](double sum) { return sum > m_most; }))
            out.left_out += leave_out(group, spots, sums, bounds);
        level.bounds.extend(bounds);
        level.entered = *std::max_element(sums.begin(), sums.end());
        out.entered = std::max(out.entered, level.entered);
    }

  private:
    using Sums = std::array<double, Spots::Most>; // instances that a ray enters that meets a spot

    const Bounds3f& box_of_group(const GroupDesc::Instances& in) const {
        return m_levels[size_t(in.group)].bounds;
    }
    double entered_by(const GroupDesc::Instances& in) const { return 1 + m_levels[size_t(in.group)].entered; }

    // Some of the instances.
    Spots spots_of(const GroupDesc& group) const {
        size_t all = 0;
        for (const auto& in : group.instances)
            all += in.size();
        const size_t step = std::max<size_t>(1, (all + Spots::Most - 1) / Spots::Most);
        Spots spots;
        size_t next = 0; // in the current list
        for (const auto& in : group.instances) {
            for (; next < in.size(); next += step)
                if (const Bounds3f box = box_of(in, next, box_of_group(in)); !box.empty())
                    spots.add(box);
            next -= in.size();
        }
        return spots;
    }

    // In chunks that are added up in order: the same sums for any number of threads.
    void add(const GroupDesc::Instances& in, const Spots& spots, Sums& sums, Bounds3f& bounds) const {
        constexpr size_t Chunk = 4096;
        struct Part {
            Sums sums{};
            Bounds3f bounds;
        };
        std::vector<Part> parts((in.size() + Chunk - 1) / Chunk);
        const double each = entered_by(in);
        tasks::parallel_chunks(in.size(), Chunk, [&](size_t begin, size_t end) {
            Part& part = parts[begin / Chunk];
            for (size_t i = begin; i < end; i++) {
                const Bounds3f box = box_of(in, i, box_of_group(in));
                part.bounds.extend(box);
                spots.overlapping(box, [&](int k, double share) { part.sums[size_t(k)] += each * share; });
            }
        });
        for (const Part& part : parts) {
            bounds.extend(part.bounds);
            for (size_t k = 0; k < sums.size(); k++)
                sums[k] += part.sums[k];
        }
    }

    // In order, what goes beyond the bound is not kept, but for the first.
    uint64_t leave_out(GroupDesc& group, const Spots& spots, Sums& sums, Bounds3f& bounds) {
        sums = {}, bounds = {};
        uint64_t left_out = 0;
        bool any = false;
        for (auto& in : group.instances) {
            const double each = entered_by(in);
            std::vector<size_t> kept;
            for (size_t i = 0; i < in.size(); i++) {
                const Bounds3f box = box_of(in, i, box_of_group(in));
                bool fits = true;
                spots.overlapping(box, [&](int k, double share) {
                    fits = fits && sums[size_t(k)] + each * share <= m_most;
                });
                if (!fits && any)
                    continue;
                any = true;
                spots.overlapping(box, [&](int k, double share) { sums[size_t(k)] += each * share; });
                bounds.extend(box);
                kept.push_back(i);
            }
            left_out += in.size() - kept.size();
            keep_some(in, kept);
        }
        std::erase_if(group.instances, [](const auto& in) { return in.size() == 0; });
        return left_out;
    }

    void keep_some(GroupDesc::Instances& in, const std::vector<size_t>& kept) {
        if (kept.size() == in.size())
            return;
        if (!in.paths.empty()) { // they lie elsewhere: the first ones
            size_t run = 0;
            while (run < kept.size() && kept[run] == run)
                run++;
            in.paths = in.paths.first(run);
            return; // what is known of the others stays behind
        }
        if (kept.empty())
            in.places = {};
        else
            keep_places(in, kept, m_room);
    }

    const store::Store& m_store;
    const std::span<GroupDesc> m_groups;
    std::vector<std::vector<float>>& m_room;
    const double m_most;
    std::vector<Level> m_levels;
};

// As if everything overlapped, which costs nothing to find out.
bool may_go_beyond(std::span<const GroupDesc> groups, double most) {
    std::vector<double> entered(groups.size());
    std::vector<int> depth(groups.size());
    bool beyond = false;
    for (size_t g = 0; g < groups.size(); g++) {
        for (const auto& in : groups[g].instances) {
            entered[g] += double(in.size()) * (1 + entered[size_t(in.group)]);
            depth[g] = std::max(depth[g], 1 + depth[size_t(in.group)]);
        }
        beyond = beyond || entered[g] > most || depth[g] > MaxDepth;
    }
    return beyond;
}

} // namespace

Nesting bound_nesting(const store::Store& store, std::span<GroupDesc> groups,
                      std::vector<std::vector<float>>& room, double most) {
    Nesting out;
    for (size_t g = 0; g < groups.size(); g++) {
        out.merged += merge_copies(groups[g], room);
        join_chains(groups, groups[g], room);
    }
    if (!may_go_beyond(groups, most))
        return out;
    Bounding bounding(store, groups, room, most);
    for (size_t g = 0; g < groups.size(); g++)
        bounding.bound(g, out);
    return out;
}

} // namespace kanuka::bvh
