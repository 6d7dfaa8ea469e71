#include "hierarchy/decode.h"

#include "hierarchy/fields.h"

namespace kanuka::hierarchy {

namespace {

float unit_of(const int32_t (&frame)[3]) {
    return std::bit_cast<float>(uint32_t(frame[1] & 255) << 23);
}

Vec3f unpack(const int32_t (&frame)[3], uint32_t word) {
    const Fields& f = field_table[uint8_t(frame[0])];
    Vec3f p;
    for (int a = 0; a < 3; a++)
        p[a] = (float(int32_t(word) & f.mask[a]) * f.scale[a] + float(frame[a] >> 8)) * unit_of(frame);
    return p;
}

Vec3f grid_vertex(const Page& page, Ref leaf, int k) {
    if (kind_of(leaf) == Kind::Grid32) {
        const Grid32& g = page.at<Grid32>(leaf);
        return unpack(g.frame, g.vertex[k]);
    }
    if (kind_of(leaf) == Kind::GridFloat) {
        const GridFloat& g = page.at<GridFloat>(leaf);
        return {g.coordinate[0][k], g.coordinate[1][k], g.coordinate[2][k]};
    }
    const Grid48& g = page.at<Grid48>(leaf);
    Vec3f p;
    for (int a = 0; a < 3; a++)
        p[a] = (float(g.coordinate[a][k]) + float(g.frame[a] >> 8)) * unit_of(g.frame);
    return p;
}

} // namespace

Corners corners_of(const Page& page, Ref leaf, uint32_t primitive) {
    Corners c;
    if (kind_of(leaf) == Kind::Triangle32) {
        const Triangle32& t = page.at<Triangle32>(leaf);
        for (int k = 0; k < 3; k++)
            c.at[k] = unpack(t.frame, t.corner[k][primitive % LeafTriangles]);
    } else if (kind_of(leaf) == Kind::TriangleFloat) {
        const TriangleFloat& t = page.at<TriangleFloat>(leaf);
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++)
                c.at[k][a] = t.coordinate[a][k][primitive % LeafTriangles];
    } else if (kind_of(leaf) == Kind::Triangle48) {
        const Triangle48& t = page.at<Triangle48>(leaf);
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++)
                c.at[k][a] = (float(t.coordinate[a][k][primitive % LeafTriangles]) + float(t.frame[a] >> 8)) *
                             unit_of(t.frame);
    } else {
        const int cell = int(primitive / 2) % 16, first = cell / 4 * LeafRow + cell % 4;
        const int order[2][3] = {{0, 1, LeafRow}, {LeafRow + 1, LeafRow, 1}};
        for (int k = 0; k < 3; k++)
            c.at[k] = grid_vertex(page, leaf, first + order[primitive & 1][k]);
    }
    return c;
}

Segment segment_of(const Page& page, Ref leaf, uint32_t number) {
    const uint32_t i = number % LeafSegments;
    Segment s;
    const auto set_radii = [&](const auto& l) {
        for (int e = 0; e < 2; e++)
            s.radius[e] =
                std::bit_cast<float>((l.radius[e][i] + l.least_radius) << FibreLattice::DroppedBits);
    };
    if (kind_of(leaf) == Kind::Fibre32) {
        const Fibre32& l = page.at<Fibre32>(leaf);
        for (int e = 0; e < 2; e++)
            s.end[e] = unpack(l.frame, l.end[e][i]);
        set_radii(l);
    } else if (kind_of(leaf) == Kind::Fibre48) {
        const Fibre48& l = page.at<Fibre48>(leaf);
        for (int e = 0; e < 2; e++)
            for (int a = 0; a < 3; a++)
                s.end[e][a] = (float(l.coordinate[a][e][i]) + float(l.frame[a] >> 8)) * unit_of(l.frame);
        set_radii(l);
    } else {
        const FibreFloat& l = page.at<FibreFloat>(leaf);
        for (int e = 0; e < 2; e++)
            for (int a = 0; a < 3; a++)
                s.end[e][a] = l.coordinate[a][e][i];
        set_radii(l);
    }
    return s;
}

Vec3f normal_of(const Page& page, const Ray& ray, const Hit& hit) {
    if (!is_of_fibres(kind_of(hit.leaf)))
        return corners_of(page, hit.leaf, hit.primitive).normal();
    const Segment s = segment_of(page, hit.leaf, hit.primitive / 2);
    Vec3f normal; // from the middle of the ball that was hit
    for (int a = 0; a < 3; a++)
        normal[a] = float(double(ray.o[a]) + double(hit.t) * double(ray.d[a]) - double(s.end[0][a]) -
                          double(hit.u) * (double(s.end[1][a]) - double(s.end[0][a])));
    return normal;
}

} // namespace kanuka::hierarchy
