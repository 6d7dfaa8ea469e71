// A primitive's varying data, checked and made ready for interpolation: plain float arrays with a class.
#pragma once

#include <string>
#include <vector>

#include "base/error.h"
#include "grid/grid.h"
#include "scene/scene.h"

namespace kanuka::geom {

// How many values of each class a primitive needs.
struct ItemCounts {
    size_t uniform = 1, varying = 0, vertex = 0, facevarying = 0;
};

struct Primvar {
    enum class Target : uint8_t { Channel, S, T, ST, Normal };
    std::string name;
    scene::Detail detail = scene::Detail::Varying;
    int components = 1;
    Target target = Target::Channel;
    int channel = -1;            // index into Grid::primvars
    scene::Buffer<float> values; // item * components + component

    float operator()(size_t item, int c) const { return values[item * components + c]; }
    // Where component c goes in a grid.
    float* destination(grid::Grid& grid, int c) const;
};

struct Primvars {
    std::vector<Primvar> list;
    bool normals = false;      // one of them is the shading normal
    bool s = false, t = false; // texture coordinates are given

    // Makes Grid::primvars, zeroed; the grid must be allocated.
    void allocate_channels(grid::Grid& grid) const;
    const Primvar* find(std::string_view name) const;
    void keep_normals(); // alone
};

// Everything but P, Pw, Pz, width, constants and strings. Points, vectors and normals are taken to the
// page's space. A value list that is too short is reported and left out.
Primvars collect_primvars(const scene::Primitive& primitive, const Transform& page_from_object,
                          const ItemCounts& counts, Journal& journal);

// Interpolates a value by its class from four corners, for all faces with a bilinear parametrisation.
inline bool is_corner_class(scene::Detail d) {
    return d == scene::Detail::Varying || d == scene::Detail::FaceVarying || d == scene::Detail::FaceVertex;
}

} // namespace kanuka::geom
