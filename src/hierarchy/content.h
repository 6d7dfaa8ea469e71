// What pages are made of, for those that are kept: told apart by digests, and counted.
#pragma once

#include <cstdint>
#include <string>

#include "base/digest.h"
#include "hierarchy/build.h"

namespace kanuka::hierarchy {

// All that a page, or the vote for its lattice, takes from these.
void put(Digester& d, const GridView& grid);
void put(Digester& d, const MeshView& mesh);
void put(Digester& d, const FibreView& fibre);
// Lattices are few numbers, which are kept with a page.
void put(Digester& d, const Lattices& lattices);

struct ContentSize {
    uint64_t grids = 0, triangles = 0, segments = 0;
};
// Why a page that passes structural_refusal_of() is none of a content of this size; empty = every hit lies in
// one of its grids, triangles or segments.
std::string names_refusal_of(const Page& page, const ContentSize& of);

} // namespace kanuka::hierarchy
