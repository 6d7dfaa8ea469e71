#include "hierarchy/decode.h"

#include "hierarchy/fields.h"

namespace kanuka::hierarchy {

namespace {

float unit_of(const int32_t (&frame)[3]) {
    return std::bit_cast<float>(uint32_t(frame[1] & 255) << 23);
}

[[gnu::always_inline]] inline Vec3f unpack(const int32_t (&frame)[3], uint32_t word) {
    const Fields& f = field_table[uint8_t(frame[0])];
    Vec3f p;
    for (int a = 0; a < 3; a++)
        p[a] = (float(int32_t(word) & f.mask[a]) * f.scale[a] + float(frame[a] >> 8)) * unit_of(frame);
    return p;
}

[[gnu::always_inline]] inline Vec3f coordinates(const int32_t (&frame)[3], uint32_t x, uint32_t y,
                                                uint32_t z) {
    const uint32_t field[3] = {x, y, z};
    Vec3f p;
    for (int a = 0; a < 3; a++)
        p[a] = (float(field[a]) + float(frame[a] >> 8)) * unit_of(frame);
    return p;
}

// Vertex k of a leaf: of grids as it is numbered, of others corner by corner (end by end), eight each.
Vec3f vertex(const Grid32& g, uint32_t k) {
    return unpack(g.frame, g.vertex[k]);
}
Vec3f vertex(const Grid48& g, uint32_t k) {
    return coordinates(g.frame, g.coordinate[0][k], g.coordinate[1][k], g.coordinate[2][k]);
}
Vec3f vertex(const GridFloat& g, uint32_t k) {
    return {g.coordinate[0][k], g.coordinate[1][k], g.coordinate[2][k]};
}
Vec3f vertex(const Triangle32& t, uint32_t k) {
    return unpack(t.frame, t.corner[k / 8][k % 8]);
}
Vec3f vertex(const Fibre32& f, uint32_t k) {
    return unpack(f.frame, f.end[k / 8][k % 8]);
}
template <class Leaf>
    requires requires(const Leaf& l) { l.coordinate[0][0][0], l.frame[0]; }
Vec3f vertex(const Leaf& l, uint32_t k) {
    return coordinates(l.frame, l.coordinate[0][k / 8][k % 8], l.coordinate[1][k / 8][k % 8],
                       l.coordinate[2][k / 8][k % 8]);
}
template <class Leaf>
    requires requires(const Leaf& l) { l.coordinate[0][0][0], l.count; }
Vec3f vertex(const Leaf& l, uint32_t k) {
    return {l.coordinate[0][k / 8][k % 8], l.coordinate[1][k / 8][k % 8], l.coordinate[2][k / 8][k % 8]};
}

// What `of` gives of a leaf; of one of shapes that change as it is then, by the operations of traversal.
template <class Of>
auto at_fraction(const Page& page, Ref leaf, float fraction, const Of& of) {
    return with_leaf(page, leaf, [&](const auto& begin) {
        const auto first = of(begin);
        return page.changes() ? first + (of((&begin)[1]) - first) * fraction : first;
    });
}
Vec3f vertex_of(const Page& page, Ref leaf, uint32_t k, float fraction) {
    return at_fraction(page, leaf, fraction, [k](const auto& l) { return vertex(l, k); });
}
float radius_of(const Page& page, Ref leaf, uint32_t end, uint32_t number, float fraction) {
    return at_fraction(page, leaf, fraction, [&](const auto& l) {
        if constexpr (requires { l.radius; })
            return std::bit_cast<float>((l.radius[end][number] + l.least_radius)
                                        << FibreLattice::DroppedBits);
        else
            return 0.0f;
    });
}

} // namespace

namespace {

// A part of those who call it: what calls return in memory is read back before it is whole.
[[gnu::always_inline]] inline Corners read_corners(const Page& page, Ref leaf, uint32_t primitive,
                                                   float fraction) {
    constexpr uint32_t Order[2][3] = {{0, 1, LeafRow}, {LeafRow + 1, LeafRow, 1}};
    const uint32_t cell = primitive / 2 % 16, first = cell / 4 * LeafRow + cell % 4;
    const bool changes = page.changes();
    return with_leaf(page, leaf, [&]<class Leaf>(const Leaf& l) __attribute__((always_inline)) {
        constexpr bool IsGrid =
            std::is_same_v<Leaf, Grid32> || std::is_same_v<Leaf, Grid48> || std::is_same_v<Leaf, GridFloat>;
        Corners c;
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t v =
                IsGrid ? first + Order[primitive & 1][k] : k * LeafTriangles + primitive % LeafTriangles;
            c.at[k] = vertex(l, v);
            if (changes)
                c.at[k] = c.at[k] + (vertex((&l)[1], v) - c.at[k]) * fraction;
        }
        return c;
    });
}

} // namespace

Corners corners_of(const Page& page, Ref leaf, uint32_t primitive, float fraction) {
    return read_corners(page, leaf, primitive, fraction);
}

Segment segment_of(const Page& page, Ref leaf, uint32_t number, float fraction) {
    const uint32_t i = number % LeafSegments;
    Segment s;
    for (uint32_t e = 0; e < 2; e++) {
        s.end[e] = vertex_of(page, leaf, e * LeafSegments + i, fraction);
        s.radius[e] = radius_of(page, leaf, e, i, fraction);
    }
    return s;
}

Vec3f normal_of(const Page& page, const Ray& ray, const Hit& hit, float fraction) {
    if (!is_of_fibres(kind_of(hit.leaf)))
        return read_corners(page, hit.leaf, hit.primitive, fraction).normal();
    const Segment s = segment_of(page, hit.leaf, hit.primitive / 2, fraction);
    Vec3f normal; // from the middle of the ball that was hit
    for (int a = 0; a < 3; a++)
        normal[a] = float(double(ray.o[a]) + double(hit.t) * double(ray.d[a]) - double(s.end[0][a]) -
                          double(hit.u) * (double(s.end[1][a]) - double(s.end[0][a])));
    return normal;
}

} // namespace kanuka::hierarchy
