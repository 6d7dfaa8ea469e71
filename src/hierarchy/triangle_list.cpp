#include "hierarchy/triangle_list.h"

#include <cstring>

namespace kanuka::hierarchy {

void TriangleList::add(const Vec3f (&corners)[3]) {
    Triangle& triangle = m_triangles.emplace_back();
    for (int c = 0; c < 3; c++) {
        const Vertex vertex{{corners[c].x, corners[c].y, corners[c].z, 0}};
        const auto same = std::ranges::find_if(m_vertices, [&](const Vertex& other) {
            return std::memcmp(vertex.at, other.at, sizeof vertex.at) == 0; // zeros have signs
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
