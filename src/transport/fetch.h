// Lobe inputs at a hit, interpolated between the four (or three) vertices around it. All lanes of a call are
// hits on shapes of one layering program.
#pragma once

#include "transport/hit_place.h"

namespace kanuka::transport {

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
            const auto c = load_rows<4>(m_code.page_floats(), kanuka::select(constant, base, Int<W>(0)));
            c0 = c[0], c1 = c[1], c2 = c[2], scale = c[3];
        }
        if (!all(constant)) {
            Float<W> v0, v1, v2, m(1.0f);
            Vec3<Float<W>> rgb = interpolate_rgb(base, constant);
            if (input.wide) { // twice the largest component, to stay where spectra are smooth, as encode.cpp
                m = max(max(max(rgb.x, rgb.y), rgb.z) * Float<W>(2.0f), Float<W>(1e-20f));
                rgb = rgb * (Float<W>(1.0f) / m);
            }
            bsdf::uplift(m_scene.spectra.uplift, rgb, v0, v1, v2);
            c0 = kanuka::select(constant, c0, v0), c1 = kanuka::select(constant, c1, v1),
            c2 = kanuka::select(constant, c2, v2);
            scale = kanuka::select(constant, scale, m);
        }
        const Spectrum<W> s = bsdf::sigmoid_spectrum(c0, c1, c2, m_l) * scale;
        return m_scene.spectra.tables.empty() ? s : select_measured(m_scene, c0, c1, scale, m_l, s);
    }

    Float<W> number(const bsdf::MaterialCode::Place& input) const {
        if (input.word < 0)
            return Float<W>(input.fallback.x);
        Int<W> base, stride;
        entry(input.word, base, stride);
        const Mask<W> constant = stride == Int<W>(0);
        Float<W> r(0.0f);
        if (any(constant))
            r = gather(m_code.page_floats() + input.half, kanuka::select(constant, base, Int<W>(0)));
        if (!all(constant)) {
            Float<W> value[4];
            for (int k = 0; k < 4; k++) {
                const Int<W> at = kanuka::select(constant, Int<W>(0), base + m_place.vertex[k]);
                const Int<W> word = gather(m_code.page_words, at);
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
            c0 = gather(m_code.page_floats(), at), c1 = gather(m_code.page_floats() + 1, at);
            c2 = gather(m_code.page_floats() + 2, at), scale = gather(m_code.page_floats() + 3, at);
        }
        if (!all(constant)) {
            // Twice the largest component, to stay where spectra are smooth, as encode.cpp has it.
            const Vec3<Float<W>> rgb = interpolate_rgb(base, constant);
            const Float<W> m = max(max(rgb.x, rgb.y), rgb.z) * Float<W>(2.0f);
            Float<W> v0, v1, v2;
            bsdf::uplift(m_scene.spectra.uplift, rgb * (Float<W>(1.0f) / max(m, Float<W>(1e-20f))), v0, v1,
                         v2);
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
            sum =
                fma(m_place.weight[k], gather(m_code.page_floats(), base + stride * m_place.vertex[k]), sum);
        // The weights' sum is one but for rounding.
        return kanuka::select(constant, gather(m_code.page_floats(), base), sum);
    }

    // A unit vector of any length between vertices; zero where nobody said.
    Vec3<Float<W>> direction(const bsdf::MaterialCode::Place& input) const {
        Int<W> base, stride;
        entry(input.word, base, stride);
        return direction_at(base, stride);
    }

    // The shading normal, in the space of the shape; zero where the shape has none.
    Vec3<Float<W>> normal(const ShapeLanes<W>& shape) const {
        Int<W> base, stride;
        entry(m_code.words, base, stride);
        return if_any(shape, direction_at(base, stride));
    }
    // At the time of the hit.
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
        return decode_oct(gather(m_code.page_words, kanuka::select(m, base + vertex, Int<W>(0))));
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
            const F turn = value[k] - nearest;
            sum = fma(m_place.weight[k], turn - F(0.5f) * floor(fma(turn, F(2.0f), F(0.5f))), sum);
        }
        return nearest + sum;
    }

    void entry(int word, Int<W>& base, Int<W>& stride) const {
        // And the next entry, or inputs.
        const auto row = load_rows<4>(m_code.page_words, m_table + Int<W>(2 * word));
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
            const auto c = load_rows<4>(m_code.page_floats(), kanuka::select(constant, base, Int<W>(0)));
            n = {c[0], c[1], c[2]};
        }
        if (!all(constant)) {
            Vec3<Float<W>> sum{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
            for (int k = 0; k < 4; k++) {
                const Int<W> at = kanuka::select(constant, Int<W>(0), base + m_place.vertex[k]);
                sum += decode_oct(gather(m_code.page_words, at)) * m_place.weight[k];
            }
            n = kanuka::select(constant, n, sum);
        }
        return n;
    }

    Vec3<Float<W>> interpolate_rgb(Int<W> base, Mask<W> constant) const {
        Vec3<Float<W>> sum{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
        for (int k = 0; k < 4; k++) {
            const Int<W> word =
                gather(m_code.page_words, kanuka::select(constant, Int<W>(0), base + m_place.vertex[k]));
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
