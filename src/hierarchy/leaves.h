// Leaves of any kind against rays.
#pragma once

#include "hierarchy/fibre_lanes.h"
#include "hierarchy/leaf_lanes.h"
#include "hierarchy/page.h"
#include "hierarchy/triangle_lanes.h"

namespace kanuka::hierarchy {

// Calls `body` with the content of a leaf, read as it is needed or, `Kept`, once; a place of another page has
// none.
template <int W, bool Kept, class Body>
[[gnu::always_inline]] inline void read_leaf(const Page& page, Ref leaf, Body&& body) {
    const auto grid = [&]<class Reader>(const Reader& reader) {
        body(std::conditional_t<Kept, KeptGridVertices<W, Reader>, GridVertices<W, Reader>>(reader));
    };
    const auto triangles = [&]<class Reader>(const Reader& reader) {
        body(std::conditional_t<Kept, KeptTriangles<Reader>, Reader>(reader));
    };
    const auto fibres = [&]<class Reader>(const Reader& reader) {
        body(std::conditional_t<Kept, KeptFibres<Reader>, Reader>(reader));
    };
    switch (kind_of(leaf)) {
    case Kind::Grid32:
        return grid(Reader32(page.at<Grid32>(leaf)));
    case Kind::Grid48:
        return grid(Reader48(page.at<Grid48>(leaf)));
    case Kind::GridFloat:
        return grid(ReaderFloat(page.at<GridFloat>(leaf)));
    case Kind::Triangle32:
        return triangles(TriangleReader32(page.at<Triangle32>(leaf)));
    case Kind::Triangle48:
        return triangles(TriangleReader48(page.at<Triangle48>(leaf)));
    case Kind::TriangleFloat:
        return triangles(TriangleReaderFloat(page.at<TriangleFloat>(leaf)));
    case Kind::Fibre32:
        return fibres(FibreReader32(page.at<Fibre32>(leaf)));
    case Kind::Fibre48:
        return fibres(FibreReader48(page.at<Fibre48>(leaf)));
    case Kind::FibreFloat:
        return fibres(FibreReaderFloat(page.at<FibreFloat>(leaf)));
    default:
        return;
    }
}

// Offers to `found` whatever of the content the ray hits: found(primitive, t, u, v), which answers whether
// that is all.
template <int W, class Content, class Found>
[[gnu::always_inline]] inline void trace_leaf(const Content& content, const TracedRay& ray, Found&& found) {
    if constexpr (requires { content.segments(); })
        trace_fibre_leaf(content, ray, found);
    else if constexpr (requires { content.count(); })
        trace_triangle_leaf(content, ray, found);
    else
        trace_grid_leaf<W>(content, ray, found);
}

} // namespace kanuka::hierarchy
