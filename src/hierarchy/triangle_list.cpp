#include "hierarchy/triangle_list.h"

#include <algorithm>
#include <array>
#include <bit>

namespace kanuka::hierarchy {

void TriangleList::add(const Vec3f (&corners)[3]) {
    Triangle& triangle = m_triangles.emplace_back();
    for (int c = 0; c < 3; c++) {
        const Vertex vertex{{corners[c].x, corners[c].y, corners[c].z, 0}};
        using Bits = std::array<uint32_t, 4>; // zeros have signs
        const auto same = std::ranges::find_if(m_vertices, [&](const Vertex& other) {
            return std::bit_cast<Bits>(vertex) == std::bit_cast<Bits>(other);
        });
        triangle.vertex[c] = uint32_t(same - m_vertices.begin());
        if (same == m_vertices.end())
            m_vertices.push_back(vertex);
    }
    triangle.across = -1;
    for (int a = 0; a < 3; a++)
        if (corners[0][a] == corners[1][a] && corners[1][a] == corners[2][a])
            triangle.across = int8_t(a);
}

} // namespace kanuka::hierarchy
