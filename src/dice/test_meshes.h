// Reading meshes that are traced.
#pragma once

#include <set>

#include "dice/test_dicing.h"

namespace kanuka::dice::test {

inline Vec3f vertex(const Diced& d, uint32_t i) {
    return d.mesh_vertices.position(int(i));
}

// The triangles that are traced, each starting at its lowest vertex: quads as (0, 1, 3) and (2, 3, 1).
inline std::multiset<std::array<uint32_t, 3>> triangles(const grid::TracedMesh& m) {
    std::multiset<std::array<uint32_t, 3>> out;
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        if (a == b || b == c || c == a)
            return;
        std::array<uint32_t, 3> t{a, b, c};
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        out.insert(t);
    };
    for (size_t f = 0; f < m.indices.size(); f += m.vertices_per_face) {
        const uint32_t* q = &m.indices[f];
        if (m.vertices_per_face == 3) {
            add(q[0], q[1], q[2]);
        } else {
            add(q[0], q[1], q[3]);
            add(q[2], q[3], q[1]);
        }
    }
    return out;
}

} // namespace kanuka::dice::test
