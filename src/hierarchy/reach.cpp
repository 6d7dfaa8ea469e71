#include "hierarchy/reach.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/lanes.h"
#include "hierarchy/nodes.h"

namespace kanuka::hierarchy {

namespace {

// Boxes that hold all of a page: of its nodes' children, as far down as there are not too many.
std::vector<Bounds3f> boxes_of(const Page& page, size_t most) {
    std::vector<Bounds3f> boxes;
    std::vector<Ref> nodes{page.header().root};
    for (size_t i = 0; i < nodes.size(); i++) {
        const Node& node = page.at<Node>(nodes[i]);
        const Children children = Children::of(node.children);
        for (int c = 0; c < children.count; c++)
            if (children.kind == Kind::Nodes && boxes.size() + (nodes.size() - i) * 8 < most)
                nodes.push_back(children.ref(uint32_t(c)));
            else
                boxes.push_back(box_of_child(node, c));
    }
    return boxes;
}

} // namespace

Reach::Reach(const Page& page) {
    const Bounds3f all = page.bounds();
    m_center = all.lo * 0.5f + all.hi * 0.5f;
    const std::vector<Bounds3f> boxes = boxes_of(page, MostBoxes);
    m_most = 0;
    for (int face = 0; face < 6; face++)
        for (int at = 0; at < Face; at++) {
            const int a = face / 2, b = (a + 1) % 3, c = (a + 2) % 3, column = at % Row, row = at / Row;
            double d[3];
            d[a] = face % 2 == 0 ? -1 : 1;
            d[b] = 2.0 * column / Steps - 1, d[c] = 2.0 * row / Steps - 1;
            double most = 0;
            for (const Bounds3f& box : boxes) {
                double reach = 0;
                for (int k = 0; k < 3; k++)
                    reach += d[k] * (double(d[k] < 0 ? box.lo[k] : box.hi[k]) - double(m_center[k]));
                most = std::max(most, reach);
            }
            m_reach[face * Face + at] = float(most);
            m_most = std::max(m_most, float(most));
        }
}

Bounds3f Reach::box(const Transform& t) const {
    // Rows of the matrix are directions of the page along which the world's axes lie: upwards, and downwards.
    alignas(32) float rows[3][8] = {}, reach[8], length[8];
    for (size_t k = 0; k < 3; k++)
        for (size_t a = 0; a < 3; a++)
            rows[k][a] = float(t.m[a][k]), rows[k][4 + a] = -rows[k][a];
    const Float<8> x = Float<8>::load(rows[0]), y = Float<8>::load(rows[1]), z = Float<8>::load(rows[2]);
    const Float<8> ax = abs(x), ay = abs(y), az = abs(z), longest = max(max(ax, ay), az);
    const Mask<8> by_x = (ax >= ay) & (ax >= az), by_y = ay >= az;
    const Float<8> along = select(by_x, x, select(by_y, y, z)), first = select(by_x, y, select(by_y, z, x)),
                   second = select(by_x, z, select(by_y, x, y));
    const Int<8> axis = select(by_x, Int<8>(0), select(by_y, Int<8>(2), Int<8>(4)));
    const Int<8> face = axis + select(along < Float<8>(0.0f), Int<8>(0), Int<8>(1));
    const Float<8> half(0.5f * Steps);
    const Float<8> u = fma(first / longest, half, half), v = fma(second / longest, half, half);
    // What is no number counts as the first: of such matrices nothing stands.
    const auto step_of = [](Float<8> at) { return max(min(to_int(at), Int<8>(Steps - 1)), Int<8>(0)); };
    const Int<8> i = step_of(u), j = step_of(v);
    const Float<8> fu = u - Float<8>(i), fv = v - Float<8>(j);
    const Int<8> at = face * Int<8>(Face) + j * Int<8>(Row) + i;
    const auto reach_at = [&](int du, int dv) { return gather(m_reach, at + Int<8>(dv * Row + du)); };
    const Float<8> r00 = reach_at(0, 0), r10 = reach_at(1, 0), r01 = reach_at(0, 1), r11 = reach_at(1, 1);
    const Float<8> low = fma(r10 - r00, fu, r00), high = fma(r11 - r01, fu, r01);
    (fma(high - low, fv, low) * longest).store(reach);
    longest.store(length);
    Bounds3f box;
    for (size_t a = 0; a < 3; a++) {
        double middle = t.m[a][3];
        for (size_t k = 0; k < 3; k++)
            middle += t.m[a][k] * double(m_center[int(k)]);
        // Of rays, and of the operations above.
        const double more = 0x1p-20 * std::abs(middle) + 0x1p-18 * double(length[a]) * double(m_most);
        box.lo[int(a)] = float(middle - double(reach[4 + a]) - more);
        box.hi[int(a)] = float(middle + double(reach[a]) + more);
    }
    return box;
}

} // namespace kanuka::hierarchy
