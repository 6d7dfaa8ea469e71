#include "hierarchy/world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/tasks.h"
#include "hierarchy/instances.h"
#include "hierarchy/level_boxes.h"

namespace kanuka::hierarchy {

namespace {

bool is_affine(const Transform& t) {
    return t.m[3][0] == 0 && t.m[3][1] == 0 && t.m[3][2] == 0 && t.m[3][3] == 1;
}
// False: no ray can be taken there.
bool stands(const Placed& p) {
    return p.stays || (std::ranges::all_of(p.rows, [](float v) { return std::isfinite(v); }) &&
                       PageFromWorld(p.rows.data()).is_held());
}
InstanceLeaf leaf_of(const Placed& p, uint32_t number) {
    return {number, p.run, p.matrix, p.seen};
}

MovingLeaf moving_leaf(const Placed& p, uint32_t number, Boxes& boxes) {
    MovingLeaf leaf{};
    leaf.place = leaf_of(p, number);
    if (!boxes.move(number))
        return leaf;
    const std::span<Bounds3f> all = boxes.of(number);
    leaf.times = uint32_t(all.size());
    leaf.path = p.path, leaf.path_bytes = p.path ? uint32_t(p.path->bytes_read()) : 0;
    leaf.boxes = all.size() > 2 ? all.data() : nullptr;
    return leaf;
}

// At most eight instances that lie together, one behind the other in the order of the items.
struct Eight {
    uint32_t begin;
    uint8_t count;
    Kind kind;
    uint64_t at; // where their leaves are

    uint64_t bytes() const { return count * UnitsOf[size_t(kind)] * UnitBytes; }
    uint64_t end() const { // of the room they have: groups begin at multiples of that
        constexpr uint64_t Align = GroupUnits * UnitBytes;
        return at + (bytes() + Align - 1) / Align * Align;
    }
};
template <class Instances>
LargeVector<Eight> eights_of(const SplitTree& tree, const Instances& instances, uint64_t& at) {
    LargeVector<Eight> eights;
    for (const SplitTree::Branch& b : tree.branches)
        if (b.left < 0)
            eights.push_back({b.begin, uint8_t(b.end - b.begin), Kind::Instance, 0});
    for (Eight& e : eights) {
        for (uint32_t i = 0; i < e.count; i++)
            if (instances.moves(tree.items[e.begin + i].index()))
                e.kind = Kind::Moving;
        e.at = at;
        at = e.end();
    }
    return eights;
}

// Of instances by their numbers: what stands at each, and how it is written.
template <class PlacementOf>
class Standing {
  public:
    Standing(std::span<const Page> pages, const Reaches& reaches, Boxes& boxes,
             const PlacementOf& placement_of)
        : m_pages(pages), m_reaches(reaches), m_boxes(boxes), m_placement_of(placement_of) {}

    enum class State : uint8_t { Nothing, LeftOut, Stands }; // Nothing: of an empty page
    State state(size_t i, BoxOfEnds& ends) const {
        const Placed p = m_placement_of(i);
        const std::span<const Page> pages = m_pages.subspan(p.page, std::max(p.intervals, 1u));
        Bounds3f box;
        for (const Page& page : pages)
            if (page.header().root != NoRef)
                box.extend(page.bounds());
        if (box.empty()) // of nothing there is nothing to see
            return State::Nothing;
        bool is_there = true;
        if (moves(i)) {
            if (p.path)
                p.path->bound(box, m_boxes.of(i), m_reaches.around(p.page));
            else
                bound(pages, m_boxes.of(i));
            for (const Bounds3f& at : m_boxes.of(i))
                is_there &= is_somewhere(at.lo) && is_somewhere(at.hi);
            if (is_there)
                ends = straight(m_boxes.of(i));
        } else {
            if (!p.stays)
                box = m_reaches.box(p.page, transform_of(p.rows), box);
            is_there = stands(p) && is_somewhere(box.lo) && is_somewhere(box.hi);
            ends = {box, box};
        }
        return is_there ? State::Stands : State::LeftOut;
    }
    bool look(size_t i, BoxOfEnds& ends) const { return state(i, ends) == State::Stands; }
    bool moves(size_t i) const { return m_boxes.move(i); }
    void write(uint32_t i, InstanceLeaf& leaf) const { leaf = leaf_of(m_placement_of(i), i); }
    void write(uint32_t i, MovingLeaf& leaf) const { leaf = moving_leaf(m_placement_of(i), i, m_boxes); }

  private:
    std::span<const Page> m_pages;
    const Reaches& m_reaches;
    Boxes& m_boxes;
    const PlacementOf& m_placement_of;
};

// `ends`: of each instance, where some move; else none.
template <class Instances>
PageMemory build_level(LargeVector<Item> items, const Instances& instances, std::span<const BoxOfEnds> ends) {
    SplitTree order = items.empty() ? SplitTree() : split_all(std::move(items), 8);
    Header h{};
    h.magic = Magic, h.version = Version;
    h.nodes = sizeof(Header);
    uint64_t eights_end = h.nodes;
    const LargeVector<Eight> eights = eights_of(order, instances, eights_end);
    const auto box_of = [&](const Item& item, int end) {
        return ends.empty() ? item.bounds() : end == 0 ? ends[item.index()].begin : ends[item.index()].end;
    };
    MovingGroups moving;
    Bounds3f bounds;
    if (!eights.empty()) {
        h.nodes = eights_end;
        bounds = order.branches[0].box();
    }
    if (!ends.empty()) {
        for (LargeVector<Bounds3f>& boxes : moving.at_ends)
            boxes.resize(eights.size());
        moving.moves.resize(eights.size());
        for (size_t k = 0; k < eights.size(); k++)
            for (uint32_t i = eights[k].begin; i < eights[k].begin + eights[k].count; i++) {
                const BoxOfEnds& box = ends[order.items[i].index()];
                moving.at_ends[0][k].extend(box.begin), moving.at_ends[1][k].extend(box.end);
                moving.moves[k] |= box.moves();
                bounds.extend(box.all());
            }
    }
    NodeTree tree = make_nodes(order, h.nodes, ends.empty() ? nullptr : &moving);
    order.branches = {};
    h.node_bytes = tree.nodes.size() * sizeof(Node);
    h.bytes = h.nodes + h.node_bytes;
    if (h.bytes + PaddingBytes > Children::MostBytes)
        throw Error("a level of instances of the ray tracer is larger than 2 GiB");
    h.root = eights.empty() ? NoRef : make_ref(tree.root, h.nodes);
    for (int a = 0; a < 3; a++)
        h.lower[a] = bounds.lo[a], h.upper[a] = bounds.hi[a];

    PageMemory memory = PageMemory::unwritten(h.bytes + PaddingBytes);
    uint8_t* const bytes = reinterpret_cast<uint8_t*>(memory.data());
    std::memset(bytes + h.bytes, 0, memory.size() - h.bytes);
    tasks::parallel_chunks(eights.size(), PlacesATask / 8, [&](size_t begin, size_t end) {
        for (size_t k = begin; k < end; k++) {
            const Eight& e = eights[k];
            Group group{e.kind, e.count};
            std::memset(bytes + e.at + e.bytes(), 0, e.end() - e.at - e.bytes());
            for (uint32_t i = 0; i < e.count; i++) {
                const Item& item = order.items[e.begin + i];
                if (e.kind == Kind::Moving)
                    instances.write(item.index(), reinterpret_cast<MovingLeaf*>(bytes + e.at)[i]);
                else
                    instances.write(item.index(), reinterpret_cast<InstanceLeaf*>(bytes + e.at)[i]);
            }
            for (int end = 0; end < tree.leaf_ends[k]; end++) {
                for (uint32_t i = 0; i < e.count; i++)
                    group.box[i] = box_of(order.items[e.begin + i], end);
                write_node(tree.nodes[tree.leaf_at[k] + uint32_t(end)], group,
                           Children{e.kind, e.count, uint32_t(e.at / UnitBytes)}.word());
            }
        }
    });
    if (!tree.nodes.empty())
        std::memcpy(bytes + h.nodes, tree.nodes.data(), h.node_bytes);
    std::memcpy(bytes, &h, sizeof h);
    return memory;
}

} // namespace

uint32_t World::add(const Page& page) {
    const uint32_t number = uint32_t(m_pages.size());
    m_pages.emplace_back(reinterpret_cast<const std::byte*>(page.bytes()), number);
    m_nesting.push_back(0);
    return number;
}

int World::nesting_of(uint32_t page) const {
    if (page >= m_pages.size())
        throw Error("an instance stands for page " + std::to_string(page) + " of " +
                    std::to_string(m_pages.size()));
    return m_nesting[page] + 1;
}

template <class Instances>
PageMemory World::build(size_t count, const Instances& instances, bool moves) {
    using State = Instances::State;
    LargeVector<Item> items(count);
    LargeVector<State> states(count);
    LargeVector<BoxOfEnds> ends(moves ? count : 0);
    tasks::parallel_chunks(count, m_moves ? 256 : PlacesATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            BoxOfEnds box;
            states[i] = instances.state(i, box);
            items[i] = Item(moves ? halfway(box.begin, box.end) : box.begin, uint32_t(i));
            if (moves)
                ends[i] = box;
        }
    });
    size_t kept =
        size_t(std::ranges::find_if(states, [](State s) { return s != State::Stands; }) - states.begin());
    for (size_t i = kept; i < count; i++) {
        m_left_out += states[i] == State::LeftOut;
        if (states[i] == State::Stands)
            items[kept++] = items[i];
    }
    items.resize(kept);
    return build_level(std::move(items), instances, ends);
}

template <class PlacementOf>
uint32_t World::add_level(size_t count, std::span<const size_t> places, int nesting, bool moves,
                          const PlacementOf& placement_of, Level* before) {
    if (nesting > MostNesting)
        throw Error("instances lie " + std::to_string(nesting) + " deep in each other; at most " +
                    std::to_string(MostNesting) + " can be traced");
    Boxes boxes;
    if (moves)
        boxes.measure(count, placement_of);
    m_moves |= moves;
    const Reaches reaches(m_pages, places);
    const Standing standing(m_pages, reaches, boxes, placement_of);
    if (before && before->count == count && refit(*before, standing)) {
        m_levels.push_back(std::move(*before));
        m_refitted++;
    } else {
        if (before)
            *before = {}; // there is room for another then
        m_levels.push_back({build(count, standing, moves), count});
    }
    m_surplus = std::max(m_surplus, boxes.surplus());
    if (!boxes.are_two)
        m_boxes.push_back(std::move(boxes.boxes));
    const uint32_t number = add(m_levels.back().memory.page());
    m_nesting[number] = nesting;
    return number;
}

uint32_t World::add_run(uint32_t page, std::span<const float> matrices) {
    Placements run{page};
    run.world_from_page = Places(matrices);
    m_runs.push_back(run);
    return uint32_t(m_runs.size() - 1);
}

uint32_t World::add(std::span<const Placement> placements) {
    int nesting = 1;
    bool moves = false;
    std::vector<size_t> places(m_pages.size());
    for (const Placement& p : placements) {
        nesting = std::max(nesting, nesting_of(p.page));
        moves |= p.path && p.path->moves();
        places[p.page]++;
    }
    LargeVector<float>& matrices = m_matrices.emplace_back(12 * placements.size());
    for (size_t i = 0; i < placements.size(); i++) {
        const Placement& p = placements[i];
        float* const rows = matrices.data() + 12 * i;
        if (p.path)
            p.path->at(0, rows);
        else
            for (size_t k = 0; k < 12; k++)
                rows[k] = is_affine(p.world_from_page) ? float(p.world_from_page.m[k / 4][k % 4]) : NAN;
    }
    std::vector<uint32_t> run_of(m_pages.size());
    for (size_t page = 0; page < places.size(); page++)
        if (places[page] > 0)
            run_of[page] = add_run(uint32_t(page), matrices);
    return add_level(
        placements.size(), places, nesting, moves,
        [&](size_t i) {
            const Placement& p = placements[i];
            Placed placed{p.page, run_of[p.page], uint32_t(i)};
            std::copy_n(matrices.data() + 12 * i, 12, placed.rows.begin());
            placed.path = p.path && p.path->moves() ? p.path : nullptr;
            return placed;
        },
        nullptr);
}

uint32_t World::add(std::span<const Placements> runs, Level* before) {
    int nesting = 1;
    std::vector<size_t> first; // instance of each run
    size_t count = 0;
    bool moves = false;
    std::vector<size_t> places(m_pages.size());
    const uint32_t first_run = uint32_t(m_runs.size());
    for (const Placements& run : runs) {
        nesting = std::max(nesting, nesting_of(run.page));
        moves |= run.intervals > 0 || std::ranges::any_of(run.paths, &MotionPath::moves);
        if (run.intervals > 0 && run.page + run.intervals > m_pages.size())
            throw Error("what changes has fewer pages than intervals of time");
        m_fades |= !run.seen.empty();
        first.push_back(count);
        count += run.size();
        places[run.page] += run.size();
        m_runs.push_back(run);
        if (!std::ranges::all_of(run.paths, &MotionPath::moves)) { // some have a path and stand still
            LargeVector<float>& matrices = m_matrices.emplace_back(12 * run.paths.size());
            for (size_t i = 0; i < run.paths.size(); i++)
                run.paths[i].at(0, matrices.data() + 12 * i);
            m_runs.back().world_from_page = Places(matrices);
        }
    }
    return add_level(
        count, places, nesting, moves,
        [&](size_t i) {
            const size_t r = size_t(std::upper_bound(first.begin(), first.end(), i) - first.begin()) - 1;
            const Placements& run = m_runs[first_run + r];
            Placed placed{run.page, first_run + uint32_t(r)};
            placed.stays = run.stays(), placed.intervals = run.intervals;
            if (placed.stays)
                return placed;
            const size_t k = i - first[r];
            if (!run.seen.empty())
                placed.seen = run.seen[k];
            if (!run.paths.empty() && run.paths[k].moves())
                placed.path = &run.paths[k];
            else
                placed.matrix = uint32_t(run.world_from_page.number(k)), placed.rows = run.world_from_page[k];
            return placed;
        },
        before);
}

std::vector<Level> World::take_levels() {
    std::vector<Level> all(std::make_move_iterator(m_levels.begin()),
                           std::make_move_iterator(m_levels.end()));
    m_levels.clear();
    return all;
}

size_t World::level_bytes() const {
    size_t bytes = 0;
    for (const Level& level : m_levels)
        bytes += level.memory.size();
    for (const LargeVector<Bounds3f>& boxes : m_boxes)
        bytes += boxes.size() * sizeof(Bounds3f);
    for (const LargeVector<float>& matrices : m_matrices)
        bytes += matrices.size() * sizeof(float);
    return bytes;
}

} // namespace kanuka::hierarchy
