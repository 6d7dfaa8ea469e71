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

template <class Reader>
concept ReadsFibres = requires(const Reader& r) { r.segments(); };
template <class Reader>
concept ReadsTriangles = requires(const Reader& r) { r.count(); };

// What a leaf is read by: as it is needed or, Kept, once.
template <int W, bool Kept, class Reader>
using ContentOf = std::conditional_t<
    ReadsFibres<Reader>, std::conditional_t<Kept, KeptFibres<Reader>, Reader>,
    std::conditional_t<ReadsTriangles<Reader>, std::conditional_t<Kept, KeptTriangles<Reader>, Reader>,
                       std::conditional_t<Kept, KeptGridVertices<W, Reader>, GridVertices<W, Reader>>>>;

// Calls `body` with the content of a leaf.
template <int W, bool Kept, class Body>
[[gnu::always_inline]] inline void read_leaf(const Page& page, Ref leaf, Body&& body) {
    with_leaf(page, leaf, [&](const auto& bytes) __attribute__((always_inline)) {
        using Reader = decltype(reader_of(bytes));
        body(ContentOf<W, Kept, Reader>(Reader(bytes)));
    });
}
// Of shapes that change: body(at), and at(fraction) is the content as it is then, in the interval.
template <int W, bool Kept, class Body>
[[gnu::always_inline]] inline void read_changing_leaf(const Page& page, Ref leaf, Body&& body) {
    with_leaf(page, leaf, [&](const auto& begin) __attribute__((always_inline)) {
        using Reader = decltype(reader_of(begin));
        using End = ContentOf<W, Kept, Reader>;
        const End first{Reader(begin)}, last{Reader((&begin)[1])};
        body([&](float fraction) __attribute__((always_inline)) {
            if constexpr (ReadsFibres<End>)
                return ChangingFibres<End>(first, last, fraction);
            else if constexpr (ReadsTriangles<End>)
                return ChangingTriangles<End>(first, last, fraction);
            else
                return ChangingGridVertices<W, End>(first, last, fraction);
        });
    });
}

// Offers to `found` whatever of the content the ray hits: found(primitive, t, u, v), which answers whether
// that is all.
template <int W, class Content, class Found>
[[gnu::always_inline]] inline void trace_leaf(const Content& content, const TracedRay& ray, Found&& found) {
    if constexpr (ReadsFibres<Content>)
        trace_fibre_leaf(content, ray, found);
    else if constexpr (ReadsTriangles<Content>)
        trace_triangle_leaf(content, ray, found);
    else
        trace_grid_leaf<W>(content, ray, found);
}

} // namespace kanuka::hierarchy
