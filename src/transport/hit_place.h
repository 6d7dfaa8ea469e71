// From a hit to the vertices around it: the record of its shape, and where on the shape it lies.
#pragma once

#include "transport/light_environment.h"

namespace kanuka::transport {

// Normals go with the cofactors of a row-major 3x4 matrix; those keep their direction under mirroring once
// multiplied by the sign of the determinant.
template <int W>
Vec3<Float<W>> turn_normal(const Float<W> m[12], const Vec3<Float<W>>& n) {
    using V = Vec3<Float<W>>;
    const V row0(m[0], m[1], m[2]), row1(m[4], m[5], m[6]), row2(m[8], m[9], m[10]);
    const V c0 = cross(row1, row2), c1 = cross(row2, row0), c2 = cross(row0, row1);
    return V(dot(c0, n), dot(c1, n), dot(c2, n)) * copysign(Float<W>(1.0f), dot(row0, c0));
}

template <int W>
struct ShapeLanes {
    Int<W> flags, slot_table, positions, mu, mv, steps, nu, nv, indices, emitter, object_id, interior;

    ShapeLanes(const int32_t* shapes, Int<W> shape) {
        using R = store::ShapeRecord;
        const auto row = load_rows<store::ShapeWords>(shapes, shape * Int<W>(store::ShapeWords));
        const auto get = [&](size_t offset) { return bitcast_int(row[offset / 4]); };
        flags = get(offsetof(R, flags));
        slot_table = get(offsetof(R, slot_table));
        positions = get(offsetof(R, positions));
        mu = get(offsetof(R, mu));
        mv = get(offsetof(R, mv));
        steps = get(offsetof(R, steps));
        nu = get(offsetof(R, nu));
        nv = get(offsetof(R, nv));
        indices = get(offsetof(R, indices));
        emitter = get(offsetof(R, emitter));
        object_id = get(offsetof(R, object_id));
        interior = get(offsetof(R, interior));
    }
    Mask<W> has(int flag) const { return (flags & Int<W>(flag)) != Int<W>(0); }
};

// Between which steps of its shape's motion a hit is. Loaded only in scenes where something moves.
template <int W>
struct MotionLanes {
    Mask<W> moving;
    Int<W> segment, stride;
    Float<W> f;

    MotionLanes(const int32_t* shapes, Int<W> shape, Float<W> time) {
        using R = store::ShapeRecord;
        const Int<W> at = shape * Int<W>(store::ShapeWords);
        const Int<W> segments = gather(shapes + offsetof(R, motion_segments) / 4, at);
        stride = gather(shapes + offsetof(R, motion_stride) / 4, at);
        moving = segments > Int<W>(0);
        const Float<W> x = time * Float<W>(segments); // as the ray tracer has it
        segment = max(min(to_int(x), segments - Int<W>(1)), Int<W>(0));
        f = x - Float<W>(segment);
    }
};

// Where on its shape a hit lies: the traced cell with local coordinates, and the triangle of the cell.
template <int W>
struct HitPlace {
    // Corners of its triangle among the traced vertices: one that both triangles of the cell share, (1, 0),
    // or a mesh triangle's second; the other two.
    Int<W> anchor{0}, other[2] = {0, 0};
    Int<W> triangle{0}; // number of the triangle on the shape
    // Vertices of the record around the hit, and their weights.
    Int<W> vertex[4] = {0, 0, 0, 0};
    Float<W> weight[4] = {0.0f, 0.0f, 0.0f, 0.0f};

    // `page_words`: of the material that the shapes are made of.
    HitPlace(const uint32_t* page_words, const ShapeLanes<W>& s, Int<W> prim, Float<W> u, Float<W> v) {
        using R = store::ShapeRecord;
        const Mask<W> mesh = s.has(R::Mesh);
        if (!all(mesh))
            place_on_grid(s, u, v);
        const Mask<W> fibre = s.has(R::Fibre);
        if (any(mesh & !fibre))
            place_on_mesh(page_words, s, prim, u, v, mesh & !fibre);
        if (any(fibre))
            place_on_fibre(page_words, s, prim, u, fibre);
    }

  private:
    void place_on_grid(const ShapeLanes<W>& s, Float<W> u, Float<W> v) {
        using F = Float<W>;
        using I = Int<W>;
        const F zero(0.0f), one(1.0f);
        const F x = clamp(u, zero, one) * F(s.mu), y = clamp(v, zero, one) * F(s.mv);
        const I i = max(min(to_int(x), s.mu - I(1)), I(0)), j = max(min(to_int(y), s.mv - I(1)), I(0));
        const F fx = x - F(i), fy = y - F(j);
        const Mask<W> second = fx + fy > one;
        anchor = j * (s.mu + I(1)) + i + I(1);
        other[0] = anchor + s.mu;
        other[1] = select(second, other[0] + I(1), anchor - I(1));
        triangle = (j * s.mu + i) * I(2) + select(second, I(1), I(0));
        F a = clamp(u, zero, one) * F(s.nu), b = clamp(v, zero, one) * F(s.nv); // on the shading lattice
        const Mask<W> collapsed = s.has(store::ShapeRecord::Collapsed);
        if (any(collapsed)) {
            F ca, cb;
            collapsed_parameters(s, i, j, fx, fy, second, ca, cb);
            a = select(collapsed, ca, a);
            b = select(collapsed, cb, b);
        }
        const I si = max(min(to_int(a), s.nu - I(1)), I(0)), sj = max(min(to_int(b), s.nv - I(1)), I(0));
        const F p = clamp(a - F(si), zero, one), q = clamp(b - F(sj), zero, one);
        const I row = s.nu + I(1);
        vertex[0] = sj * row + si;
        vertex[1] = vertex[0] + I(1);
        vertex[2] = vertex[0] + row;
        vertex[3] = vertex[2] + I(1);
        weight[0] = (one - p) * (one - q);
        weight[1] = p * (one - q);
        weight[2] = (one - p) * q;
        weight[3] = p * q;
    }

    // Boundary vertices that were moved onto a coarser edge carry that edge's parameters.
    void collapsed_parameters(const ShapeLanes<W>& s, Int<W> i, Int<W> j, Float<W> fx, Float<W> fy,
                              Mask<W> second, Float<W>& a, Float<W>& b) const {
        using F = Float<W>;
        using I = Int<W>;
        const I nibble(15), one_i(1);
        const I step_u = one_i << (s.steps & nibble), step_v = one_i << ((s.steps >> 4) & nibble);
        const auto edge = [&](int e) { return one_i << ((s.steps >> (8 + 4 * e)) & nibble); };
        // The rule of dice/split.h, nearest_kept: the nearest; from midway, towards the nearer end of the
        // edge; from its middle, towards its second end on VMax and UMax (`high` = 1).
        const auto snap = [](I k, I step, I n, int high) {
            const I twice = (k & (step - I(1))) << 1, down = k & (I(0) - step);
            const Mask<W> up = (twice > step) | ((twice == step) & ((k << 1) + I(high) > n));
            return select(up, down + step, down);
        };
        const auto corner = [&](int di, int dj, F& x, F& y) {
            const I vi = i + I(di), vj = j + I(dj);
            I px = vi * step_u, py = vj * step_v;
            const I sx0 = snap(px, edge(grid::VMin), s.nu, 0), sx1 = snap(px, edge(grid::VMax), s.nu, 1);
            const I sy0 = snap(py, edge(grid::UMin), s.nv, 0), sy1 = snap(py, edge(grid::UMax), s.nv, 1);
            const I mx = select(vj == I(0), sx0, select(vj == s.mv, sx1, px));
            const I my = select(vi == I(0), sy0, select(vi == s.mu, sy1, py));
            x = F(mx), y = F(my);
        };
        F x0, y0, x1, y1, x2, y2, x3, y3;
        corner(0, 0, x0, y0);
        corner(1, 0, x1, y1);
        corner(0, 1, x2, y2);
        corner(1, 1, x3, y3);
        const F one(1.0f);
        const F w0 = one - fx - fy, w3 = fx + fy - one;
        a = select(second, w3 * x3 + (one - fx) * x2 + (one - fy) * x1, w0 * x0 + fx * x1 + fy * x2);
        b = select(second, w3 * y3 + (one - fx) * y2 + (one - fy) * y1, w0 * y0 + fx * y1 + fy * y2);
    }

    // Between the two vertices of a segment. The anchor is the first of them, inside of the fibre.
    void place_on_fibre(const uint32_t* page_words, const ShapeLanes<W>& s, Int<W> prim, Float<W> u,
                        Mask<W> fibre) {
        using F = Float<W>;
        using I = Int<W>;
        const F zero(0.0f), one(1.0f);
        const I first = gather(page_words, select(fibre, s.indices + prim, I(0)));
        const I last = select(s.has(store::ShapeRecord::Balls), first, first + I(1));
        const F f = select(u >= zero, min(u, one), zero); // not a number on a ball
        anchor = select(fibre, first, anchor);
        other[0] = select(fibre, first, other[0]), other[1] = select(fibre, first, other[1]);
        triangle = select(fibre, prim, triangle);
        for (int k = 0; k < 4; k++) {
            vertex[k] = select(fibre, k == 0 ? first : last, vertex[k]);
            weight[k] = select(fibre, k == 0 ? one - f : k == 1 ? f : zero, weight[k]);
        }
    }

    void place_on_mesh(const uint32_t* page_words, const ShapeLanes<W>& s, Int<W> prim, Float<W> u,
                       Float<W> v, Mask<W> mesh) {
        using F = Float<W>;
        using I = Int<W>;
        const F zero(0.0f), one(1.0f);
        const Mask<W> quads = mesh & s.has(store::ShapeRecord::Quads);
        const I zero_i(0);
        const I base = select(mesh, s.indices + prim * select(quads, I(4), I(3)), zero_i);
        const auto face = load_rows<4>(page_words, base); // a triangle's fourth is not looked at
        const I v0 = bitcast_int(face[0]), v1 = bitcast_int(face[1]), v2 = bitcast_int(face[2]),
                v3 = bitcast_int(face[3]);
        const Mask<W> second = quads & (u + v > one);
        // Quads split into (v0, v1, v3) and (v2, v3, v1); triangles are (v0, v1, v2).
        const I p0 = select(second, v2, v0), p1 = select(second, v3, v1);
        const I p2 = select(quads, select(second, v1, v3), v2);
        const F b1 = select(second, one - u, u), b2 = select(second, one - v, v);
        anchor = select(mesh, v1, anchor);
        other[0] = select(mesh, p0, other[0]);
        other[1] = select(mesh, select(quads, v3, v2), other[1]);
        triangle = select(mesh, select(quads, prim + prim + select(second, I(1), zero_i), prim), triangle);
        vertex[0] = select(mesh, p0, vertex[0]);
        vertex[1] = select(mesh, p1, vertex[1]);
        vertex[2] = select(mesh, p2, vertex[2]);
        vertex[3] = select(mesh, p2, vertex[3]);
        weight[0] = select(mesh, one - b1 - b2, weight[0]);
        weight[1] = select(mesh, b1, weight[1]);
        weight[2] = select(mesh, b2, weight[2]);
        weight[3] = select(mesh, zero, weight[3]);
    }
};

// Corners of the triangle that a hit lies on: among the traced vertices, and among those that inputs are kept
// of. (Of grids without coarsened edges.)
template <int W>
struct Corners {
    Int<W> traced[3], vertex[3];
    Float<W> weight[3];

    Corners(const ShapeLanes<W>& s, const HitPlace<W>& place, Float<W> u, Float<W> v) {
        using F = Float<W>;
        using I = Int<W>;
        const Mask<W> mesh = s.has(store::ShapeRecord::Mesh);
        const F zero(0.0f), one(1.0f);
        const F x = clamp(u, zero, one) * F(s.mu), y = clamp(v, zero, one) * F(s.mv);
        const I i = max(min(to_int(x), s.mu - I(1)), I(0)), j = max(min(to_int(y), s.mv - I(1)), I(0));
        const F fx = x - F(i), fy = y - F(j);
        const Mask<W> second = fx + fy > one;
        const I step_u = I(1) << (s.steps & I(15)), step_v = I(1) << ((s.steps >> 4) & I(15));
        const F of_corner[3] = {select(second, fx + fy - one, one - fx - fy), select(second, one - fy, fx),
                                select(second, one - fx, fy)};
        const I one_i(1), zero_i(0);
        const I a[3] = {select(second, one_i, zero_i), one_i, zero_i},
                b[3] = {select(second, one_i, zero_i), zero_i, one_i};
        for (int k = 0; k < 3; k++) {
            const I on_grid = (j + b[k]) * (s.mu + one_i) + i + a[k];
            traced[k] = select(mesh, place.vertex[k], on_grid);
            vertex[k] =
                select(mesh, place.vertex[k], (j + b[k]) * step_v * (s.nu + one_i) + (i + a[k]) * step_u);
            weight[k] = select(mesh, place.weight[k], of_corner[k]);
        }
    }
};

} // namespace kanuka::transport
