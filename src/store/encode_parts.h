// The parts of encode_grid(), each in a file of its name. Every one appends its own to what those before it
// made.
#pragma once

#include "store/grid_inputs.h"

namespace kanuka::store {

// Lobe inputs: a word of the vertex record after the other, the constant ones folded.
void encode_words(GridInputs& inputs, const grid::WordLayout& layout, const color::Palette& palette,
                  Encoded& out);

// Unit normals at the first step: one if they are all the same.
struct UnitNormals {
    std::vector<Vec3f> each;
    bool same() const { return each.size() == 1; }
    const Vec3f& of(int vertex) const { return each[same() ? 0 : size_t(vertex)]; }
};
UnitNormals encode_normals(const grid::Grid& grid, Encoded& out);
// dPdu at every vertex.
void encode_tangents(const grid::Grid& grid, const UnitNormals& normals, Encoded& out);
// Does a normal lean farther from its facet than dicing lets it?
bool is_coarse(const ShadedGrid& shaded, const UnitNormals& normals, const Encoded& encoded);

// Triangles that shine.
void encode_emitters(const ShadedGrid& shaded, GridInputs& inputs, const color::Palette& palette,
                     const UnitNormals& normals, Encoded& out);

} // namespace kanuka::store
