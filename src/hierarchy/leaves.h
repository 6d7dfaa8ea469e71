// Leaves of any kind against rays.
#pragma once

#include <type_traits>

#include "hierarchy/changing_lanes.h"
#include "hierarchy/fibre_lanes.h"
#include "hierarchy/leaf_lanes.h"
#include "hierarchy/page.h"
#include "hierarchy/triangle_lanes.h"

namespace kanuka::hierarchy {

inline Reader32 reader_of(const Grid32& leaf) {
    return Reader32(leaf);
}
inline Reader48 reader_of(const Grid48& leaf) {
    return Reader48(leaf);
}
inline ReaderFloat reader_of(const GridFloat& leaf) {
    return ReaderFloat(leaf);
}
inline TriangleReader32 reader_of(const Triangle32& leaf) {
    return TriangleReader32(leaf);
}
inline TriangleReader48 reader_of(const Triangle48& leaf) {
    return TriangleReader48(leaf);
}
inline TriangleReaderFloat reader_of(const TriangleFloat& leaf) {
    return TriangleReaderFloat(leaf);
}
inline FibreReader32 reader_of(const Fibre32& leaf) {
    return FibreReader32(leaf);
}
inline FibreReader48 reader_of(const Fibre48& leaf) {
    return FibreReader48(leaf);
}
inline FibreReaderFloat reader_of(const FibreFloat& leaf) {
    return FibreReaderFloat(leaf);
}

// Calls `body` with the content of a leaf, read as it is needed or, `Kept`, once.
template <int W, bool Kept, class Body>
[[gnu::always_inline]] inline void read_leaf(const Page& page, Ref leaf, Body&& body) {
    with_leaf(page, leaf, [&](const auto& bytes) __attribute__((always_inline)) {
        using Reader = decltype(reader_of(bytes));
        const Reader reader(bytes);
        if constexpr (requires { reader.segments(); })
            body(std::conditional_t<Kept, KeptFibres<Reader>, Reader>(reader));
        else if constexpr (requires { reader.count(); })
            body(std::conditional_t<Kept, KeptTriangles<Reader>, Reader>(reader));
        else
            body(std::conditional_t<Kept, KeptGridVertices<W, Reader>, GridVertices<W, Reader>>(reader));
    });
}
// Likewise of shapes that change, as they are at `fraction` of the interval.
template <int W, class Body>
[[gnu::always_inline]] inline void read_changing_leaf(const Page& page, Ref leaf, float fraction,
                                                      Body&& body) {
    with_leaf(page, leaf, [&](const auto& begin) __attribute__((always_inline)) {
        using Reader = decltype(reader_of(begin));
        const Reader first(begin), last((&begin)[1]);
        if constexpr (requires { first.segments(); })
            body(ChangingFibres<Reader>(first, last, fraction));
        else if constexpr (requires { first.count(); })
            body(ChangingTriangles<Reader>(first, last, fraction));
        else
            body(ChangingGridVertices<W, Reader>(first, last, fraction));
    });
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
