#include "hierarchy/split.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/tasks.h"

namespace kanuka::hierarchy {

namespace {

constexpr int Bins = 16;
// Below this many items a tree is made by one task; above, all runs of one depth are split at once.
constexpr uint32_t OneTask = 4096;
// So few items are sorted, and all ways to split them are looked at that fill leaves.
constexpr uint32_t Sorted = 48;

// That so many items fill, the last one in part; as the heuristic wants it.
float leaves_of(uint32_t items, uint32_t leaf) {
    const uint32_t leaves = (items + leaf - 1) / leaf;
    return float(leaves);
}

class Binning {
  public:
    Binning(const Item* items, const Run& run) : m_first(run.centres.lo) {
        const Float4 extent = run.centres.hi - run.centres.lo;
        for (int a = 0; a < 3; a++) // just below Bins: the last centre is in the last bin
            m_scale[a] = extent[a] > 0 ? float(Bins) * 0.9999f / extent[a] : 0.0f;
        for (uint32_t i = run.begin; i < run.end; i++) {
            const Float4 at = (items[i].twice_centre() - m_first) * m_scale;
            for (int a = 0; a < 3; a++) {
                Bin& b = m_bins[a][bin(at[a])];
                b.box.extend(items[i]);
                b.count++;
            }
        }
    }
    // The cheapest plane between two bins; false if all centres are in one.
    bool find(uint32_t leaf) {
        float best = FLT_MAX;
        for (int a = 0; a < 3; a++) {
            if (!(m_scale[a] > 0 && m_scale[a] < FLT_MAX))
                continue;
            float right[Bins];
            Bin sum;
            for (int b = Bins - 1; b > 0; b--) {
                sum.add(m_bins[a][b]);
                right[b] = sum.cost(leaf);
            }
            sum = {};
            for (int b = 1; b < Bins; b++) {
                sum.add(m_bins[a][b - 1]);
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
            const Bin& bin = m_bins[m_axis][b];
            (b < m_plane ? two.left : two.right).box.extend(bin.box);
            two.left.end += b < m_plane ? bin.count : 0;
        }
        two.right.begin = two.left.end;
        for (Run* r : {&two.left, &two.right})
            r->centres = {upper(run.centres.lo, r->box.lo + r->box.lo),
                          lower(run.centres.hi, r->box.hi + r->box.hi)};
        return two;
    }
    bool is_left(const Item& item) const {
        return bin((item.twice_centre()[m_axis] - m_first[m_axis]) * m_scale[m_axis]) < m_plane;
    }

  private:
    struct Bin {
        Box4 box;
        uint32_t count = 0;
        void add(const Bin& b) {
            box.extend(b.box);
            count += b.count;
        }
        float cost(uint32_t leaf) const {
            return count == 0 ? FLT_MAX : box.half_area() * leaves_of(count, leaf);
        }
    };
    static int bin(float at) { return std::clamp(int(at), 0, Bins - 1); }

    Float4 m_first, m_scale{};
    Bin m_bins[3][Bins];
    int m_axis = 0, m_plane = 0;
};

// The items of a short run in the order of their centres along an axis: places in the run below the bits that
// compare as the centres do. Of equal ones the first comes first.
void sort_along(const Item* items, const Run& run, int axis, uint64_t* keys) {
    for (uint32_t i = 0; i < run.size(); i++) {
        const int32_t bits = std::bit_cast<int32_t>(items[run.begin + i].twice_centre()[axis] + 0.0f);
        const uint32_t ordered = uint32_t(bits) ^ (uint32_t(bits >> 31) | 0x80000000u);
        keys[i] = uint64_t(ordered) << 32 | i;
    }
    std::sort(keys, keys + run.size());
}

// Looks at all splits where one side fills its leaves; returns where the right side begins.
uint32_t swept(Item* items, const Run& run, uint32_t leaf) {
    const uint32_t n = run.size();
    float best = FLT_MAX;
    uint64_t keys[3][Sorted];
    int axis = 0;
    uint32_t at = leaf;
    for (int a = 0; a < 3; a++) {
        sort_along(items, run, a, keys[a]);
        const auto item = [&](uint32_t i) -> const Item& { return items[run.begin + uint32_t(keys[a][i])]; };
        float right[Sorted];
        Box4 box;
        for (uint32_t i = n - 1; i > 0; i--) {
            box.extend(item(i));
            right[i] = box.half_area();
        }
        box = {};
        for (uint32_t i = 1; i < n; i++) {
            box.extend(item(i - 1));
            if (i % leaf != 0 && (n - i) % leaf != 0)
                continue;
            const float cost = box.half_area() * leaves_of(i, leaf) + right[i] * leaves_of(n - i, leaf);
            if (cost < best)
                best = cost, axis = a, at = i;
        }
    }
    Item ordered[Sorted];
    for (uint32_t i = 0; i < n; i++)
        ordered[i] = items[run.begin + uint32_t(keys[axis][i])];
    std::copy_n(ordered, n, items + run.begin);
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
                         return p < q || (p == q && a.index < b.index);
                     });
    return middle;
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
    int32_t add(const Run& run) {
        const int32_t me = int32_t(m_branches.size());
        m_branches.push_back({run.begin, run.end, -1, -1, 1, 0, run.box.bounds(), run.box.half_area()});
        if (run.size() <= m_most)
            return me;
        const TwoRuns two = split(m_items, run, m_most);
        const int32_t left = add(two.left), right = add(two.right);
        SplitTree::Branch& b = m_branches[size_t(me)];
        b.left = left, b.right = right;
        return me;
    }

    Item* m_items;
    uint32_t m_most;
    std::vector<SplitTree::Branch> m_branches;
};

} // namespace

void Run::measure(const Item* items) {
    box = {}, centres = {};
    for (uint32_t i = begin; i < end; i++) {
        box.extend(items[i]);
        centres.extend(items[i].twice_centre(), items[i].twice_centre());
    }
}

TwoRuns split(Item* items, const Run& run, uint32_t leaf) {
    uint32_t middle = run.begin;
    if (run.depth < HalvedFrom && leaf > 1 && run.size() <= Sorted) {
        middle = swept(items, run, leaf);
    } else if (run.depth < HalvedFrom) {
        Run measured = run;
        for (int attempt = 0; attempt < 2;
             attempt++) { // bounds of the centres may be too wide to tell them apart
            Binning bins(items, measured);
            if (bins.find(leaf)) {
                std::partition(items + run.begin, items + run.end,
                               [&](const Item& i) { return bins.is_left(i); });
                return bins.sides(measured);
            }
            measured.measure(items);
        }
    }
    if (middle == run.begin)
        middle = halved(items, run);
    TwoRuns two{{run.begin, middle, {}, {}, run.depth + 1}, {middle, run.end, {}, {}, run.depth + 1}};
    two.left.measure(items), two.right.measure(items);
    return two;
}

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
    const auto branch_of = [](const Run& r) {
        return SplitTree::Branch{r.begin, r.end, -1, -1, 1, 0, r.box.bounds(), r.box.half_area()};
    };
    Run all{0, uint32_t(tree.items.size()), {}, {}, 0};
    all.measure(data);
    tree.branches.push_back(branch_of(all));

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
            const int32_t left = int32_t(tree.branches.size());
            tree.branches[size_t(large[i].branch)].left = left;
            tree.branches[size_t(large[i].branch)].right = left + 1;
            for (const Run& r : {split_into[i].left, split_into[i].right}) {
                next.push_back({r, int32_t(tree.branches.size())});
                tree.branches.push_back(branch_of(r));
            }
        }
        large = std::move(next);
    }

    // The trees below, each by a task, one behind the other.
    std::vector<std::vector<SplitTree::Branch>> grown(small.size());
    tasks::parallel_for(small.size(), [&](size_t i) { grown[i] = Growth(data, most).grow(small[i].run); });
    for (size_t i = 0; i < small.size(); i++) {
        const int32_t shift = int32_t(tree.branches.size()) - 1; // the first stands in the upper part
        for (size_t k = 0; k < grown[i].size(); k++) {
            SplitTree::Branch b = grown[i][k];
            if (b.left >= 0)
                b.left += shift, b.right += shift;
            if (k == 0)
                tree.branches[size_t(small[i].branch)] = b;
            else
                tree.branches.push_back(b);
        }
    }
    for (size_t i = tree.branches.size(); i-- > 0;) {
        SplitTree::Branch& b = tree.branches[i];
        if (b.left < 0)
            continue;
        const SplitTree::Branch &l = tree.branches[size_t(b.left)], &r = tree.branches[size_t(b.right)];
        b.leaves = l.leaves + r.leaves;
        b.height = std::max(l.height, r.height) + 1;
    }
    return tree;
}

} // namespace kanuka::hierarchy
