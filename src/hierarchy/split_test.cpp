// Trees of splits beside those that the rules in split.h and docs/hierarchy.md give, followed one by one and
// by sorts of the standard library.
#include "hierarchy/split.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <numeric>

#include "base/tasks.h"
#include "hierarchy/test_oracle.h"

namespace kanuka::hierarchy {
namespace {

using testing::Random;

struct Box {
    float lo[3], hi[3];
    uint32_t index;
    float centre(int a) const { return lo[a] + hi[a]; }
};

// What a tree comes to, from the left: how deep each leaf lies, and what is in it.
using Told = std::vector<std::pair<int, std::vector<uint32_t>>>;

class Oracle {
  public:
    Oracle(std::vector<Box> boxes, size_t most) : m_boxes(std::move(boxes)), m_most(most) {}
    Told tell() {
        float lo[3], hi[3];
        bound_centres(0, m_boxes.size(), lo, hi);
        grow(0, m_boxes.size(), lo, hi, 0);
        return m_told;
    }

  private:
    using Iterator = std::vector<Box>::iterator;
    Iterator at(size_t i) { return m_boxes.begin() + ptrdiff_t(i); }
    void bound_centres(size_t begin, size_t end, float* lo, float* hi) {
        for (int a = 0; a < 3; a++) {
            const auto less = [a](const Box& p, const Box& q) { return p.centre(a) < q.centre(a); };
            const auto [least, most] = std::minmax_element(at(begin), at(end), less);
            lo[a] = least->centre(a), hi[a] = most->centre(a);
        }
    }
    float half_area(size_t begin, size_t end) const {
        float d[3];
        for (int a = 0; a < 3; a++) {
            float lo = FLT_MAX, hi = -FLT_MAX;
            for (size_t i = begin; i < end; i++)
                lo = std::min(lo, m_boxes[i].lo[a]), hi = std::max(hi, m_boxes[i].hi[a]);
            d[a] = hi - lo;
        }
        return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
    }
    float cost(size_t begin, size_t end) const {
        return half_area(begin, end) * float((end - begin + m_most - 1) / m_most);
    }

    // Where the right side begins; 0 = all centres are in one bin.
    size_t binned(size_t begin, size_t end, const float* lo, const float* hi) {
        float best = FLT_MAX;
        int axis = 0, plane = 0;
        const auto bin = [&](const Box& b, int a) {
            const float extent = hi[a] - lo[a], scale = extent > 0 ? 16.0f * 0.9999f / extent : 0.0f;
            return std::clamp(int((b.centre(a) - lo[a]) * scale), 0, 15);
        };
        const std::vector<Box> before(at(begin), at(end));
        for (int a = 0; a < 3; a++)
            for (int p = 1; p < 16; p++) {
                if (!(hi[a] > lo[a]))
                    continue;
                const size_t middle =
                    begin +
                    size_t(std::partition(at(begin), at(end), [&](const Box& b) { return bin(b, a) < p; }) -
                           at(begin));
                if (middle > begin && middle < end)
                    if (const float c = cost(begin, middle) + cost(middle, end); c < best)
                        best = c, axis = a, plane = p;
                std::copy(before.begin(), before.end(), at(begin));
            }
        if (best == FLT_MAX)
            return 0;
        return size_t(std::partition(at(begin), at(end), [&](const Box& b) { return bin(b, axis) < plane; }) -
                      m_boxes.begin());
    }
    size_t swept(size_t begin, size_t end) {
        float best = FLT_MAX;
        size_t middle = 0;
        const std::vector<Box> before(at(begin), at(end));
        std::vector<Box> chosen;
        for (int a = 0; a < 3; a++) {
            std::copy(before.begin(), before.end(), at(begin));
            std::stable_sort(at(begin), at(end),
                             [a](const Box& p, const Box& q) { return p.centre(a) < q.centre(a); });
            for (size_t i = begin + 1; i < end; i++)
                if ((i - begin) % m_most == 0 || (end - i) % m_most == 0)
                    if (const float c = cost(begin, i) + cost(i, end); c < best)
                        best = c, middle = i, chosen.assign(at(begin), at(end));
        }
        std::copy(chosen.begin(), chosen.end(), at(begin));
        return middle;
    }
    void grow(size_t begin, size_t end, const float* lo, const float* hi, int depth) {
        if (end - begin <= m_most) {
            m_told.push_back({depth, {}});
            for (size_t i = begin; i < end; i++)
                m_told.back().second.push_back(m_boxes[i].index);
            return;
        }
        float least[3], most[3];
        std::copy_n(lo, 3, least), std::copy_n(hi, 3, most);
        size_t middle = 0;
        bool bounded = false; // sides have bounds of their centres by their boxes
        if (m_most > 1 && end - begin <= 48) {
            middle = swept(begin, end);
        } else {
            bounded = (middle = binned(begin, end, least, most)) != 0;
            if (!bounded) {
                bound_centres(begin, end, least, most);
                bounded = (middle = binned(begin, end, least, most)) != 0;
            }
        }
        ASSERT_NE(middle, 0u) << "of equal boxes, which this does not do";
        for (const auto& [from, to] : {std::pair(begin, middle), std::pair(middle, end)}) {
            float side_lo[3], side_hi[3];
            bound_centres(from, to, side_lo, side_hi);
            for (int a = 0; a < 3 && bounded; a++) {
                float box_lo = FLT_MAX, box_hi = -FLT_MAX;
                for (size_t i = from; i < to; i++)
                    box_lo = std::min(box_lo, m_boxes[i].lo[a]), box_hi = std::max(box_hi, m_boxes[i].hi[a]);
                side_lo[a] = std::max(least[a], 2 * box_lo), side_hi[a] = std::min(most[a], 2 * box_hi);
            }
            grow(from, to, side_lo, side_hi, depth + 1);
        }
    }

    std::vector<Box> m_boxes;
    size_t m_most;
    Told m_told;
};

void tell(const SplitTree& tree, int32_t branch, int depth, Told& told) {
    const SplitTree::Branch& b = tree.branches[size_t(branch)];
    if (b.left >= 0) {
        tell(tree, b.left, depth + 1, told), tell(tree, b.right, depth + 1, told);
        return;
    }
    told.push_back({depth, {}});
    for (uint32_t i = b.begin; i < b.end; i++)
        told.back().second.push_back(tree.items[i].index());
}

void expect_as_told(const std::vector<Box>& boxes, uint32_t most) {
    LargeVector<Item> items;
    for (const Box& b : boxes)
        items.push_back(Item({{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}}, b.index));
    for (const int threads : {1, 3})
        tasks::with_threads(threads, [&] {
            Told told;
            tell(split_all(items, most), 0, 0, told);
            EXPECT_TRUE(told == Oracle(boxes, most).tell()) << boxes.size() << " by " << most;
        });
}

std::vector<Box> scattered(size_t count) {
    Random random{uint32_t(count)};
    std::vector<Box> boxes(count);
    for (uint32_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++) {
            const float at = random.uniform(-9, 9), half = random.uniform(0, 0.4f);
            boxes[i].lo[a] = at - half, boxes[i].hi[a] = at + half, boxes[i].index = i;
        }
    return boxes;
}
// Many centres are equal along an axis, and zero has either sign.
std::vector<Box> latticed(int side) {
    std::vector<Box> boxes;
    for (int x = -side; x <= side; x++)
        for (int z = -side; z <= side; z++)
            boxes.push_back(
                {{float(x), -0.0f, float(z)}, {float(x) + 1, 0.0f, float(z) + 1}, uint32_t(boxes.size())});
    return boxes;
}

TEST(Splits, AreThoseOfTheHeuristic) {
    for (const size_t count : {2, 9, 48, 49, 700, 6000})
        for (const uint32_t most : {1u, 4u, 8u})
            expect_as_told(scattered(count), most);
}

TEST(Splits, KeepTheOrderOfWhatIsEqual) {
    for (const int side : {1, 3, 20})
        for (const uint32_t most : {1u, 4u, 8u})
            expect_as_told(latticed(side), most);
}

TEST(Splits, OfManyAreFoundInParts) { // and the same in parallel
    expect_as_told(scattered(70000), 8);
}

TEST(Splits, OfEqualBoxesHaveAnEnd) {
    for (const uint32_t most : {1u, 8u}) {
        const SplitTree tree = split_all(LargeVector<Item>(5000, Item({{1, 1, 1}, {2, 2, 2}}, 7)), most);
        EXPECT_EQ(tree.branches[0].leaves, most == 1 ? 5000u : tree.branches.size() / 2 + 1);
        for (const SplitTree::Branch& b : tree.branches)
            EXPECT_TRUE(b.left >= 0 || b.end - b.begin <= most);
    }
}

TEST(Items, HoldEveryNumber) {
    for (const uint32_t index : {0u, 1u, 0xffffu, 0x10000u, 0x12345678u, ~0u}) {
        const Item item({{-1, 2, 3}, {4, 5, 6}}, index);
        EXPECT_EQ(item.index(), index);
        EXPECT_EQ(item.bounds().lo, Vec3f(-1, 2, 3));
        EXPECT_EQ(item.bounds().hi, Vec3f(4, 5, 6));
    }
}

} // namespace
} // namespace kanuka::hierarchy
