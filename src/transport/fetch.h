// From a hit to its place in the store: position, normals, and lobe inputs, interpolated between the four (or
// three) vertices around it. All lanes of a call are hits on shapes of one layering program.
#pragma once

#include "transport/lights.h"
#include "transport/path_state.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

using bsdf::Spectrum;

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

    HitPlace(const SceneView& scene, const ShapeLanes<W>& s, Int<W> prim, Float<W> u, Float<W> v) {
        using R = store::ShapeRecord;
        const Mask<W> mesh = s.has(R::Mesh);
        if (!all(mesh))
            place_on_grid(s, u, v);
        const Mask<W> fibre = s.has(R::Fibre);
        if (any(mesh & !fibre))
            place_on_mesh(scene, s, prim, u, v, mesh & !fibre);
        if (any(fibre))
            place_on_fibre(scene, s, prim, u, fibre);
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
    void place_on_fibre(const SceneView& scene, const ShapeLanes<W>& s, Int<W> prim, Float<W> u,
                        Mask<W> fibre) {
        using F = Float<W>;
        using I = Int<W>;
        const F zero(0.0f), one(1.0f);
        const I first = gather(scene.words, select(fibre, s.indices + prim, I(0)));
        const F f = select(u >= zero, min(u, one), zero); // not a number on a ball
        anchor = select(fibre, first, anchor);
        other[0] = select(fibre, first, other[0]), other[1] = select(fibre, first, other[1]);
        triangle = select(fibre, prim, triangle);
        for (int k = 0; k < 4; k++) {
            vertex[k] = select(fibre, k == 0 ? first : first + I(1), vertex[k]);
            weight[k] = select(fibre, k == 0 ? one - f : k == 1 ? f : zero, weight[k]);
        }
    }

    void place_on_mesh(const SceneView& scene, const ShapeLanes<W>& s, Int<W> prim, Float<W> u, Float<W> v,
                       Mask<W> mesh) {
        using F = Float<W>;
        using I = Int<W>;
        const F zero(0.0f), one(1.0f);
        const Mask<W> quads = mesh & s.has(store::ShapeRecord::Quads);
        const I zero_i(0);
        const I base = select(mesh, s.indices + prim * select(quads, I(4), I(3)), zero_i);
        const auto face = load_rows<4>(scene.words, base); // a triangle's fourth is not looked at
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

// Reads lobe inputs at a place. Constant words (stride 0) are floats already; varying ones are decoded at the
// vertices around the hit, interpolated, and then uplifted: the order that keeps a texture's colours.
template <int W>
class InputFetch {
  public:
    InputFetch(const SceneView& scene, const bsdf::MaterialCode& code, const ShapeLanes<W>& shape,
               const HitPlace<W>& place, const Float<W>* l)
        : m_scene(scene), m_code(code), m_table(shape.slot_table), m_place(place), m_l(l) {}

    Spectrum<W> color(const bsdf::MaterialCode::Place& input) const {
        if (input.word < 0) {
            // Schema defaults are greys: their spectra are constants.
            return Spectrum<W>(Float<W>(input.fallback.x));
        }
        Int<W> base, stride;
        entry(input.word, base, stride);
        const Mask<W> constant = stride == Int<W>(0);
        Float<W> c0, c1, c2, scale(1.0f);
        if (any(constant)) {
            const auto c = load_rows<4>(m_scene.floats, kanuka::select(constant, base, Int<W>(0)));
            c0 = c[0], c1 = c[1], c2 = c[2], scale = c[3];
        }
        if (!all(constant)) {
            Float<W> v0, v1, v2, m(1.0f);
            Vec3<Float<W>> rgb = interpolate_rgb(base, constant);
            if (input.wide) { // twice the largest component, to stay where spectra are smooth, as encode.cpp
                m = max(max(max(rgb.x, rgb.y), rgb.z) * Float<W>(2.0f), Float<W>(1e-20f));
                rgb = rgb * (Float<W>(1.0f) / m);
            }
            bsdf::uplift(m_scene.uplift, rgb, v0, v1, v2);
            c0 = kanuka::select(constant, c0, v0), c1 = kanuka::select(constant, c1, v1),
            c2 = kanuka::select(constant, c2, v2);
            scale = kanuka::select(constant, scale, m);
        }
        const Spectrum<W> s = bsdf::sigmoid_spectrum(c0, c1, c2, m_l) * scale;
        return m_scene.spectra.empty() ? s : select_measured(m_scene, c0, c1, scale, m_l, s);
    }

    Float<W> number(const bsdf::MaterialCode::Place& input) const {
        if (input.word < 0)
            return Float<W>(input.fallback.x);
        Int<W> base, stride;
        entry(input.word, base, stride);
        const Mask<W> constant = stride == Int<W>(0);
        Float<W> r(0.0f);
        if (any(constant))
            r = gather(m_scene.floats + input.half, kanuka::select(constant, base, Int<W>(0)));
        if (!all(constant)) {
            Float<W> value[4];
            for (int k = 0; k < 4; k++) {
                const Int<W> at = kanuka::select(constant, Int<W>(0), base + m_place.vertex[k]);
                const Int<W> word = gather(m_scene.words, at);
                value[k] = half_to_float((word >> (16 * input.half)) & Int<W>(0xffff));
            }
            r = kanuka::select(constant, r, between(input.between, value));
        }
        return r;
    }

    // Light without an upper bound: a spectrum of scale * S(lambda; c) * D65.
    Spectrum<W> amount(const bsdf::MaterialCode::Place& input) const {
        Int<W> base, stride;
        entry(input.word, base, stride);
        const Mask<W> constant = stride == Int<W>(0);
        Float<W> c0(0.0f), c1(0.0f), c2(0.0f), scale(0.0f);
        if (any(constant)) {
            const Int<W> at = kanuka::select(constant, base, Int<W>(0));
            c0 = gather(m_scene.floats, at), c1 = gather(m_scene.floats + 1, at);
            c2 = gather(m_scene.floats + 2, at), scale = gather(m_scene.floats + 3, at);
        }
        if (!all(constant)) {
            // Twice the largest component, to stay where spectra are smooth, as encode.cpp has it.
            const Vec3<Float<W>> rgb = interpolate_rgb(base, constant);
            const Float<W> m = max(max(rgb.x, rgb.y), rgb.z) * Float<W>(2.0f);
            Float<W> v0, v1, v2;
            bsdf::uplift(m_scene.uplift, rgb * (Float<W>(1.0f) / max(m, Float<W>(1e-20f))), v0, v1, v2);
            c0 = kanuka::select(constant, c0, v0), c1 = kanuka::select(constant, c1, v1);
            c2 = kanuka::select(constant, c2, v2), scale = kanuka::select(constant, scale, m);
        }
        return emission_spectrum(m_scene, c0, c1, c2, scale, m_l);
    }

    // A float that is kept as it is.
    Float<W> exact(const bsdf::MaterialCode::Place& input) const {
        if (input.word < 0)
            return Float<W>(input.fallback.x);
        Int<W> base, stride;
        entry(input.word, base, stride);
        const Mask<W> constant = stride == Int<W>(0);
        Float<W> sum(0.0f);
        for (int k = 0; k < 4; k++)
            sum = fma(m_place.weight[k], gather(m_scene.floats, base + stride * m_place.vertex[k]), sum);
        // The weights' sum is one but for rounding.
        return kanuka::select(constant, gather(m_scene.floats, base), sum);
    }

    // The shading normal, in the space of the shape; zero where the shape has none.
    Vec3<Float<W>> normal(const ShapeLanes<W>& shape) const {
        Int<W> base, stride;
        entry(m_code.words, base, stride);
        return if_any(shape, direction_at(base, stride));
    }
    // Where its shape is on its way.
    Vec3<Float<W>> normal(const ShapeLanes<W>& shape, const MotionLanes<W>& motion) const {
        Int<W> base, stride;
        entry(m_code.words, base, stride);
        // A step's normals lie behind those of the step before: three floats, or a word a vertex.
        const Int<W> each =
            kanuka::select(stride == Int<W>(0), Int<W>(3), (shape.nu + Int<W>(1)) * (shape.nv + Int<W>(1)));
        base = kanuka::select(motion.moving, base + each * motion.segment, base);
        const Vec3<Float<W>> a = direction_at(base, stride);
        const Vec3<Float<W>> b = direction_at(kanuka::select(motion.moving, base + each, base), stride);
        return if_any(shape, kanuka::select(motion.moving, a + (b - a) * motion.f, a));
    }
    // Likewise at a vertex, of lanes whose normals vary.
    Vec3<Float<W>> normal_of(Int<W> vertex, Mask<W> m) const {
        Int<W> base, stride;
        entry(m_code.words, base, stride);
        return decode_oct(gather(m_scene.words, kanuka::select(m, base + vertex, Int<W>(0))));
    }
    // The direction of dPdu, in the same space; of programs that need it.
    Vec3<Float<W>> tangent() const {
        Int<W> base, stride;
        entry(m_code.words + 1, base, stride);
        return direction_at(base, stride);
    }

  private:
    // What the vertices around have, here.
    Float<W> between(grid::Between rule, const Float<W> value[4]) const {
        using F = Float<W>;
        F sum(0.0f);
        if (rule == grid::Between::Linear) {
            for (int k = 0; k < 4; k++)
                sum = fma(m_place.weight[k], value[k], sum);
            return sum;
        }
        F most = m_place.weight[0], nearest = value[0];
        for (int k = 1; k < 4; k++) {
            nearest = kanuka::select(m_place.weight[k] > most, value[k], nearest);
            most = max(most, m_place.weight[k]);
        }
        if (rule == grid::Between::Nearest)
            return nearest;
        for (int k = 0; k < 4; k++) {
            const F way = value[k] - nearest;
            sum = fma(m_place.weight[k], way - F(0.5f) * floor(fma(way, F(2.0f), F(0.5f))), sum);
        }
        return nearest + sum;
    }

    void entry(int word, Int<W>& base, Int<W>& stride) const {
        // And the next entry, or inputs.
        const auto row = load_rows<4>(m_scene.words, m_table + Int<W>(2 * word));
        base = bitcast_int(row[0]);
        stride = bitcast_int(row[1]);
    }

    static Vec3<Float<W>> if_any(const ShapeLanes<W>& shape, const Vec3<Float<W>>& n) {
        const Vec3<Float<W>> zero{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
        return kanuka::select(shape.has(store::ShapeRecord::HasNormals), n, zero);
    }

    // A unit vector of the vertices around.
    Vec3<Float<W>> direction_at(Int<W> base, Int<W> stride) const {
        const Mask<W> constant = stride == Int<W>(0);
        Vec3<Float<W>> n{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
        if (any(constant)) {
            const auto c = load_rows<4>(m_scene.floats, kanuka::select(constant, base, Int<W>(0)));
            n = {c[0], c[1], c[2]};
        }
        if (!all(constant)) {
            Vec3<Float<W>> sum{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
            for (int k = 0; k < 4; k++) {
                const Int<W> at = kanuka::select(constant, Int<W>(0), base + m_place.vertex[k]);
                sum += decode_oct(gather(m_scene.words, at)) * m_place.weight[k];
            }
            n = kanuka::select(constant, n, sum);
        }
        return n;
    }

    Vec3<Float<W>> interpolate_rgb(Int<W> base, Mask<W> constant) const {
        Vec3<Float<W>> sum{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
        for (int k = 0; k < 4; k++) {
            const Int<W> word =
                gather(m_scene.words, kanuka::select(constant, Int<W>(0), base + m_place.vertex[k]));
            // 2^(e - 24), put together as a float: its exponent is e + 103.
            const Int<W> e = (word >> 27) & Int<W>(31);
            const Float<W> unit = bitcast_float((e + Int<W>(103)) << 23) * m_place.weight[k];
            sum += Vec3<Float<W>>(Float<W>(word & Int<W>(511)), Float<W>((word >> 9) & Int<W>(511)),
                                  Float<W>((word >> 18) & Int<W>(511))) *
                   unit;
        }
        return sum;
    }

    static Vec3<Float<W>> decode_oct(Int<W> w) {
        const Float<W> s(1 / 32767.0f), zero(0.0f), one(1.0f);
        Float<W> x = (Float<W>(w & Int<W>(0xffff)) - Float<W>(32767.0f)) * s;
        Float<W> y = (Float<W>(w >> 16) - Float<W>(32767.0f)) * s;
        const Float<W> z = one - abs(x) - abs(y);
        const Mask<W> below = z < zero;
        const Float<W> fx = copysign(one - abs(y), x), fy = copysign(one - abs(x), y);
        x = kanuka::select(below, fx, x), y = kanuka::select(below, fy, y);
        return normalize(Vec3<Float<W>>(x, y, z));
    }

    const SceneView& m_scene;
    const bsdf::MaterialCode& m_code;
    Int<W> m_table;
    const HitPlace<W>& m_place;
    const Float<W>* m_l;
};

} // namespace kanuka::transport
