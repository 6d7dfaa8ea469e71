// Subdivision meshes that several tests look at.
#pragma once

#include "geom/test_surfaces.h"

namespace kanuka::geom::testing {

// Quads around vertices of valence 3 to 6, triangles, a pentagon, creases, a border; texture coordinates at
// corners and a value at vertices.
inline scene::Primitive mixed_mesh() {
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>{4, 3, 3, 4, 4, 5, 3, 3};
    m.vertices = std::vector<int32_t>{0, 1, 5, 4, 1, 2, 5,  2, 6, 5, 2,  3, 7,  6, 4,
                                      5, 9, 8, 5, 6, 7, 10, 9, 8, 9, 11, 9, 10, 11};
    m.tags = {{"interpolateboundary", {1}, {}, {}}, {"crease", {1, 5, 9}, {2.5f}, {}}};
    scene::Primitive out;
    out.geometry = m;
    std::vector<float> p;
    const float xy[12][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 1},       {1, 1.1f},
                             {2, 1}, {3, 1}, {0, 2}, {1, 2}, {2.4f, 2.3f}, {0.8f, 3}};
    for (int i = 0; i < 12; i++)
        p.insert(p.end(), {xy[i][0], xy[i][1], 0.4f * float(i * 5 % 7) / 7});
    std::vector<float> heat, st;
    for (int i = 0; i < 12; i++)
        heat.push_back(float(i * 7 % 5));
    for (const int v : std::get<scene::SubdivisionMesh>(out.geometry).vertices)
        st.insert(st.end(), {xy[v][0] / 3, xy[v][1] / 3});
    out.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, p));
    out.primvars.set(value("heat", scene::Type::Float, scene::Detail::Vertex, heat));
    scene::Value texture = value("st", scene::Type::Float, scene::Detail::FaceVarying, st);
    texture.array_size = 2;
    out.primvars.set(texture);
    return out;
}

} // namespace kanuka::geom::testing
