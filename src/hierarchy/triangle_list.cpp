#include "hierarchy/triangle_list.h"

#include <map>
#include <tuple>

#include "hierarchy/decode.h"
#include "hierarchy/leaves.h"

namespace kanuka::hierarchy {

namespace {

// The leaves below a node; false where some are of other kinds than triangles, or there are too many.
bool collect_leaves(const Page& page, Ref ref, std::vector<Ref>& leaves) {
    if (is_of_triangles(kind_of(ref))) {
        leaves.push_back(ref);
        return leaves.size() <= TriangleList::Most;
    }
    if (kind_of(ref) != Kind::Nodes)
        return false;
    const Children children = Children::of(page.at<Node>(ref).children);
    for (int i = 0; i < children.count; i++)
        if (!collect_leaves(page, children.ref(uint32_t(i)), leaves))
            return false;
    return true;
}

uint32_t triangles_of(const Page& page, Ref leaf) {
    return with_leaf(page, leaf, [](const auto& bytes) -> uint32_t {
        if constexpr (requires { reader_of(bytes).count(); })
            return reader_of(bytes).count();
        else
            return 0;
    });
}

} // namespace

std::optional<TriangleList> TriangleList::of(const Page& page) {
    std::vector<Ref> leaves;
    const Ref root = page.header().root;
    if (root == NoRef || !collect_leaves(page, root, leaves))
        return {};
    std::ranges::sort(leaves);
    TriangleList list;
    const auto less = [](const Vec3f& a, const Vec3f& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    };
    std::map<Vec3f, uint32_t, decltype(less)> numbers(less);
    for (const Ref leaf : leaves)
        for (uint32_t i = 0; i < triangles_of(page, leaf); i++) {
            if (list.m_triangles.size() == Most)
                return {};
            Triangle& triangle = list.m_triangles.emplace_back(Triangle{{}, leaf, i});
            const Corners corners = corners_of(page, leaf, i);
            for (int c = 0; c < 3; c++) {
                const auto [at, is_new] =
                    numbers.try_emplace(corners.at[c], uint32_t(list.m_vertices.size()));
                if (is_new)
                    list.m_vertices.push_back({{corners.at[c].x, corners.at[c].y, corners.at[c].z, 0}});
                triangle.vertex[c] = at->second;
            }
        }
    return list;
}

} // namespace kanuka::hierarchy
