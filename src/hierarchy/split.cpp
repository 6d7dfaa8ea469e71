#include "hierarchy/split.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <immintrin.h>
#include <limits>

#include "base/tasks.h"

namespace kanuka::hierarchy {

namespace {

constexpr int Bins = 16;
// Below this many items a tree is made by one task; above, all runs of one depth are split at once.
constexpr uint32_t OneTask = 4096;
// So few items are sorted, and all ways to split them are looked at that fill leaves.
constexpr uint32_t Sorted = 48;
// So many are binned by one task.
constexpr uint32_t BinnedByATask = 1 << 15;

// From this depth on runs are halved, whatever that costs: so trees have an end, with any boxes.
constexpr int HalvedFrom = 40;

struct Run { // of items
    uint32_t begin = 0, end = 0;
    Box4 box, centres; // of the items; of their centres, doubled
    int depth = 0;     // below the first run

    uint32_t size() const { return end - begin; }
    void measure(const Item* items) {
        box = {}, centres = {};
        for (uint32_t i = begin; i < end; i++) {
            box.extend(items[i]);
            centres.extend(items[i].twice_centre(), items[i].twice_centre());
        }
    }
};
struct TwoRuns {
    Run left, right;
};

// That so many items fill, the last one in part; as the heuristic wants it.
float leaves_of(uint32_t items, uint32_t leaf) {
    const uint32_t leaves = (items + leaf - 1) / leaf;
    return float(leaves);
}

// A box whose upper end is written the other way round: one instruction extends both ends.
typedef float Float8 __attribute__((vector_size(32)));
struct Ends {
    Float8 least{FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX, FLT_MAX};

    Ends() = default;
    explicit Ends(const Item& i) : least(__builtin_shufflevector(i.lo, -i.hi, 0, 1, 2, 3, 4, 5, 6, 7)) {}
    void extend(const Ends& b) { least = least < b.least ? least : b.least; }
    Box4 box() const {
        return {__builtin_shufflevector(least, least, 0, 1, 2, 3),
                -__builtin_shufflevector(least, least, 4, 5, 6, 7)};
    }
};

class Binning {
  public:
    Binning(const Item* items, const Run& run) : m_first(run.centres.lo) {
        const Float4 extent = run.centres.hi - run.centres.lo;
        for (int a = 0; a < 3; a++) // just below Bins: the last centre is in the last bin
            m_scale[a] = extent[a] > 0 ? float(Bins) * 0.9999f / extent[a] : 0.0f;
        if (run.size() <= BinnedByATask) {
            add(items, run.begin, run.end);
            return;
        }
        // Boxes and counts of parts come to the same in any order.
        std::vector<Binning> parts((run.size() + BinnedByATask - 1) / BinnedByATask, *this);
        tasks::parallel_chunks(run.size(), BinnedByATask, [&](size_t begin, size_t end) {
            parts[begin / BinnedByATask].add(items, run.begin + uint32_t(begin), run.begin + uint32_t(end));
        });
        for (const Binning& part : parts)
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < Bins; b++)
                    m_boxes[a][b].extend(part.m_boxes[a][b]), m_counts[a][b] += part.m_counts[a][b];
    }
    // The cheapest plane between two bins; false if all centres are in one.
    bool find(uint32_t leaf) {
        float best = FLT_MAX;
        for (int a = 0; a < 3; a++) {
            if (!(m_scale[a] > 0 && m_scale[a] < FLT_MAX))
                continue;
            float right[Bins];
            Side sum;
            for (int b = Bins - 1; b > 0; b--) {
                sum.add(m_boxes[a][b], m_counts[a][b]);
                right[b] = sum.cost(leaf);
            }
            sum = {};
            for (int b = 1; b < Bins; b++) {
                sum.add(m_boxes[a][b - 1], m_counts[a][b - 1]);
                const float cost = sum.cost(leaf) + right[b];
                if (cost < best)
                    best = cost, m_axis = a, m_plane = b;
            }
        }
        return best < FLT_MAX;
    }
    // What lies on the two sides of it. Centres are bounded by the boxes and by what bounded them before.
    TwoRuns sides(const Run& run) const {
        TwoRuns two{{run.begin, run.begin, {}, {}, run.depth + 1},
                    {run.begin, run.end, {}, {}, run.depth + 1}};
        for (int b = 0; b < Bins; b++) {
            (b < m_plane ? two.left : two.right).box.extend(m_boxes[m_axis][b].box());
            two.left.end += b < m_plane ? m_counts[m_axis][b] : 0;
        }
        two.right.begin = two.left.end;
        for (Run* r : {&two.left, &two.right})
            r->centres = {upper(run.centres.lo, r->box.lo + r->box.lo),
                          lower(run.centres.hi, r->box.hi + r->box.hi)};
        return two;
    }
    bool is_left(const Item& item) const {
        // As add() has it.
        const float at = (item.twice_centre()[m_axis] - m_first[m_axis]) * m_scale[m_axis];
        return std::clamp(int(at), 0, Bins - 1) < m_plane;
    }

  private:
    struct Side {
        Ends box;
        uint32_t count = 0;
        void add(const Ends& b, uint32_t n) {
            box.extend(b);
            count += n;
        }
        float cost(uint32_t leaf) const {
            return count == 0 ? FLT_MAX : box.box().half_area() * leaves_of(count, leaf);
        }
    };
    void add(const Item* items, uint32_t begin, uint32_t end) {
        const auto extend = [this](int axis, size_t bin, const Ends& ends) {
            m_boxes[axis][bin].extend(ends);
            m_counts[axis][bin]++;
        };
        const __m128i last = _mm_set1_epi32(Bins - 1), zero = _mm_setzero_si128();
        for (uint32_t i = begin; i < end; i++) {
            const __m128i at = _mm_cvttps_epi32((items[i].twice_centre() - m_first) * m_scale),
                          bins = _mm_min_epi32(_mm_max_epi32(at, zero), last);
            const Ends ends(items[i]);
            extend(0, size_t(_mm_extract_epi32(bins, 0)), ends);
            extend(1, size_t(_mm_extract_epi32(bins, 1)), ends);
            extend(2, size_t(_mm_extract_epi32(bins, 2)), ends);
        }
    }

    Float4 m_first, m_scale{};
    Ends m_boxes[3][Bins];
    uint32_t m_counts[3][Bins] = {};
    int m_axis = 0, m_plane = 0;
};

// Those of the left side before the others, of which `middle` is the first: as std::partition has them, and
// without a branch that is guessed wrong every other time [Edelkamp, Weiss 2016, "BlockQuicksort: how branch
// mispredictions don't affect quicksort"].
void partition(Item* items, const Run& run, uint32_t middle, const Binning& bins) {
    constexpr uint32_t Block = 64;
    uint32_t right_ones[Block], left_ones[Block]; // that stand on the other side, inwards
    uint32_t rights = 0, lefts = 0, next_right = 0, next_left = 0, from = run.begin, to = run.end;
    for (;;) {
        while (next_right == rights && from < middle) {
            next_right = rights = 0;
            for (const uint32_t end = std::min(from + Block, middle); from < end; from++) {
                right_ones[rights] = from;
                rights += !bins.is_left(items[from]);
            }
        }
        while (next_left == lefts && to > middle) {
            next_left = lefts = 0;
            for (const uint32_t end = std::max(to - std::min(to, Block), middle); to > end;) {
                left_ones[lefts] = --to;
                lefts += bins.is_left(items[to]);
            }
        }
        const uint32_t pairs = std::min(rights - next_right, lefts - next_left);
        if (pairs == 0)
            return; // there are as many of either
        for (uint32_t k = 0; k < pairs; k++)
            std::swap(items[right_ones[next_right++]], items[left_ones[next_left++]]);
    }
}

// Integers that all differ, in order: each goes where as many are less. Of so few that is faster than to
// branch.
void sort_few(int64_t* keys, uint32_t count) {
    alignas(32) int64_t all[Sorted];
    std::copy_n(keys, count, all);
    const uint32_t end = (count + 3) / 4 * 4;
    std::fill(all + count, all + end, std::numeric_limits<int64_t>::max());
    for (uint32_t i = 0; i < count; i++) {
        const __m256i key = _mm256_set1_epi64x(all[i]);
        __m256i less = _mm256_setzero_si256();
        for (uint32_t k = 0; k < end; k += 4)
            less = _mm256_sub_epi64(
                less, _mm256_cmpgt_epi64(key, _mm256_load_si256(reinterpret_cast<const __m256i*>(all + k))));
        const __m128i two = _mm_add_epi64(_mm256_castsi256_si128(less), _mm256_extracti128_si256(less, 1));
        keys[_mm_extract_epi64(two, 0) + _mm_extract_epi64(two, 1)] = all[i];
    }
}

// The items of a short run in the order of their centres along each axis: places in the run below the bits
// that compare as the centres do. Of equal ones the first comes first.
class Orders {
  public:
    Orders() = default;
    Orders(const Item* items, const Run& run) : m_count(run.size()) {
        for (int a = 0; a < 3; a++) {
            for (uint32_t i = 0; i < m_count; i++) {
                const int32_t bits = std::bit_cast<int32_t>(items[run.begin + i].twice_centre()[a] + 0.0f);
                m_keys[a][i] = int64_t(bits ^ (bits >> 31 & 0x7fffffff)) * (int64_t(1) << 32) | i;
            }
            sort_few(m_keys[a], m_count);
        }
    }
    uint32_t operator()(int axis, uint32_t i) const { return uint32_t(m_keys[axis][i]); }

    // Those of the two sides, where the items are put in the order along an axis, `at` of them to the left.
    void cut(int axis, uint32_t at, Orders& left, Orders& right) const {
        uint32_t place[Sorted];
        for (uint32_t i = 0; i < m_count; i++)
            place[(*this)(axis, i)] = i;
        left.m_count = at, right.m_count = m_count - at;
        for (int a = 0; a < 3; a++) {
            uint32_t lefts = 0, rights = 0;
            for (uint32_t i = 0; i < m_count; i++) {
                const uint32_t to = place[(*this)(a, i)];
                const int64_t upper = m_keys[a][i] & ~int64_t(0xffffffff);
                left.m_keys[a][lefts] = upper | to, right.m_keys[a][rights] = upper | (to - at);
                lefts += to < at, rights += to >= at;
            }
            left.order_equals(a), right.order_equals(a);
        }
    }

  private:
    void order_equals(int axis) { // all others are in order
        if (!std::is_sorted(m_keys[axis], m_keys[axis] + m_count))
            sort_few(m_keys[axis], m_count);
    }

    uint32_t m_count = 0;
    int64_t m_keys[3][Sorted + 1]; // one more is written where all are on one side
};

// Looks at all splits where one side fills its leaves. Returns where the right side begins.
uint32_t swept(Item* items, const Run& run, uint32_t leaf, const Orders& orders, Orders& left,
               Orders& right) {
    const uint32_t n = run.size();
    uint64_t fill = 0; // bit i: so many items to the left, or those to the right, fill leaves
    for (uint32_t i = leaf; i < n; i += leaf)
        fill |= uint64_t(1) << i | uint64_t(1) << (n - i);
    float best = FLT_MAX;
    int axis = 0;
    uint32_t at = leaf;
    for (int a = 0; a < 3; a++) {
        const auto item = [&](uint32_t i) -> const Item& { return items[run.begin + orders(a, i)]; };
        float areas[Sorted];
        Box4 box;
        for (uint32_t i = n - 1; i > 0; i--) {
            box.extend(item(i));
            if (fill >> i & 1)
                areas[i] = box.half_area();
        }
        box = {};
        for (uint32_t i = 1; i < n; i++) {
            box.extend(item(i - 1));
            if (!(fill >> i & 1))
                continue;
            const float cost = box.half_area() * leaves_of(i, leaf) + areas[i] * leaves_of(n - i, leaf);
            if (cost < best)
                best = cost, axis = a, at = i;
        }
    }
    Item ordered[Sorted];
    for (uint32_t i = 0; i < n; i++)
        ordered[i] = items[run.begin + orders(axis, i)];
    std::copy_n(ordered, n, items + run.begin);
    orders.cut(axis, at, left, right);
    return run.begin + at;
}

uint32_t halved(Item* items, const Run& run) {
    const Float4 extent = run.centres.hi - run.centres.lo;
    const int axis = extent[0] >= extent[1]   ? (extent[0] >= extent[2] ? 0 : 2)
                     : extent[1] >= extent[2] ? 1
                                              : 2;
    const uint32_t middle = run.begin + run.size() / 2;
    std::nth_element(items + run.begin, items + middle, items + run.end,
                     [axis](const Item& a, const Item& b) {
                         const float p = a.twice_centre()[axis], q = b.twice_centre()[axis];
                         return p < q || (p == q && a.index() < b.index());
                     });
    return middle;
}

TwoRuns measured(const Item* items, const Run& run, uint32_t middle) {
    TwoRuns two{{run.begin, middle, {}, {}, run.depth + 1}, {middle, run.end, {}, {}, run.depth + 1}};
    two.left.measure(items), two.right.measure(items);
    return two;
}

// Orders the items of a run anew, those of the left one first. At least two items. A leaf that holds `leaf`
// items costs as much where it holds fewer.
TwoRuns split(Item* items, const Run& run, uint32_t leaf) {
    Run of = run;
    for (int attempt = 0; attempt < 2 && run.depth < HalvedFrom;
         attempt++) { // bounds of the centres may be too wide to tell them apart
        Binning bins(items, of);
        if (bins.find(leaf)) {
            const TwoRuns two = bins.sides(of);
            partition(items, run, two.right.begin, bins);
            return two;
        }
        of.measure(items);
    }
    return measured(items, run, halved(items, run));
}

// The tree below one run; branches are numbered from 0.
class Growth {
  public:
    Growth(Item* items, uint32_t most) : m_items(items), m_most(most) {}
    std::vector<SplitTree::Branch> grow(const Run& run) {
        add(run);
        return std::move(m_branches);
    }

  private:
    // `orders`: null = they are not known.
    int32_t add(const Run& run, const Orders* orders = nullptr) {
        const int32_t me = int32_t(m_branches.size());
        m_branches.emplace_back(run.begin, run.end, run.box);
        if (run.size() <= m_most)
            return me;
        if (run.depth < HalvedFrom && m_most > 1 && run.size() <= Sorted) {
            Orders own, left, right;
            if (!orders)
                own = Orders(m_items, run), orders = &own;
            const uint32_t middle = swept(m_items, run, m_most, *orders, left, right);
            add_sides(me, measured(m_items, run, middle), &left, &right);
        } else {
            add_sides(me, split(m_items, run, m_most), nullptr, nullptr);
        }
        return me;
    }
    void add_sides(int32_t me, const TwoRuns& two, const Orders* of_left, const Orders* of_right) {
        const int32_t left = add(two.left, of_left), right = add(two.right, of_right);
        m_branches[size_t(me)].set_children(left, m_branches[size_t(left)], right, m_branches[size_t(right)]);
    }

    Item* m_items;
    uint32_t m_most;
    std::vector<SplitTree::Branch> m_branches;
};

} // namespace

SplitTree split_all(LargeVector<Item> items, uint32_t most) {
    SplitTree tree;
    tree.items = std::move(items);
    if (tree.items.empty())
        return tree;
    Item* const data = tree.items.data();
    struct Open {
        Run run;
        int32_t branch;
    };
    Run all{0, uint32_t(tree.items.size()), {}, {}, 0};
    all.measure(data);
    std::vector<SplitTree::Branch> upper{{all.begin, all.end, all.box}};

    // The upper part, depth by depth.
    std::vector<Open> large{{all, 0}}, small;
    while (!large.empty()) {
        std::vector<Open> next;
        std::vector<TwoRuns> split_into(large.size());
        tasks::parallel_for(large.size(), [&](size_t i) {
            if (large[i].run.size() > OneTask)
                split_into[i] = split(data, large[i].run, most);
        });
        for (size_t i = 0; i < large.size(); i++) {
            if (large[i].run.size() <= OneTask) {
                small.push_back(large[i]);
                continue;
            }
            upper[size_t(large[i].branch)].left = int32_t(upper.size()); // and right comes after it
            for (const Run& r : {split_into[i].left, split_into[i].right}) {
                next.push_back({r, int32_t(upper.size())});
                upper.emplace_back(r.begin, r.end, r.box);
            }
        }
        large = std::move(next);
    }

    // The trees below, each by a task, one behind the other. Their first branches stand in the upper part.
    std::vector<std::vector<SplitTree::Branch>> grown(small.size());
    tasks::parallel_for(small.size(), [&](size_t i) { grown[i] = Growth(data, most).grow(small[i].run); });
    std::vector<size_t> first(small.size());
    size_t count = upper.size();
    for (size_t i = 0; i < small.size(); i++)
        first[i] = count, count += grown[i].size() - 1;
    tree.branches.resize(count);
    std::ranges::copy(upper, tree.branches.begin());
    tasks::parallel_for(small.size(), [&](size_t i) {
        const int32_t shift = int32_t(first[i]) - 1;
        for (size_t k = 0; k < grown[i].size(); k++) {
            SplitTree::Branch& b = tree.branches[k == 0 ? size_t(small[i].branch) : first[i] + k - 1];
            b = grown[i][k];
            if (b.left >= 0)
                b.left += shift, b.right += shift;
        }
        grown[i] = {};
    });
    for (size_t i = upper.size(); i-- > 0;)
        if (const int32_t left = upper[i].left; left >= 0)
            tree.branches[i].set_children(left, tree.branches[size_t(left)], left + 1,
                                          tree.branches[size_t(left) + 1]);
    return tree;
}

} // namespace kanuka::hierarchy
