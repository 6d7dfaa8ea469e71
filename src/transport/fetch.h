// Lobe inputs at a hit, interpolated between the four (or three) vertices around it. All lanes of a call are
// hits on shapes of one layering program.
#pragma once

#include "transport/hit_place.h"

namespace kanuka::transport {

// What the instances around hits change of their looks.
template <int W>
struct InstanceLook {
    Float<W> variant, roughness, c0, c1, c2, scale;
    Mask<W> tinted;

    InstanceLook(const VariationRow* rows, Int<W> variation) {
        const auto row = load_rows<8>(reinterpret_cast<const float*>(rows), variation << 3);
        variant = row[0], roughness = row[1], tinted = row[2] != Float<W>(0.0f);
        c0 = row[4], c1 = row[5], c2 = row[6], scale = row[7];
    }
};

// Reads lobe inputs at a place. Constant words (stride 0) are floats already; varying ones are decoded at the
// vertices around the hit, interpolated, and then uplifted: the order that keeps a texture's colours.
template <int W>
class InputFetch {
  public:
    using Place = bsdf::MaterialCode::Place;
    // `look`: null = no instance differs.
    InputFetch(const SceneView& scene, const bsdf::MaterialCode& code, const ShapeLanes<W>& shape,
               const HitPlace<W>& place, const Float<W>* l, const InstanceLook<W>* look = nullptr)
        : m_scene(scene), m_code(code), m_table(shape.slot_table), m_place(place), m_l(l), m_look(look) {}

    Spectrum<W> color(const Place& input) const {
        return differs(input) ? varied_color(input) : plain_color(input);
    }
    Float<W> number(const Place& input) const {
        return differs(input) ? varied_number(input) : plain_number(input);
    }
    // Light without an upper bound: a spectrum of scale * S(lambda; c) * D65.
    Spectrum<W> amount(const Place& input) const {
        return differs(input) ? varied_amount(input) : plain_amount(input);
    }
    // A float that is kept as it is.
    Float<W> exact(const Place& input) const {
        return differs(input) ? varied_exact(input) : plain_exact(input);
    }
    // A unit vector of any length between vertices; zero where nobody said.
    Vec3<Float<W>> direction(const Place& input) const {
        return differs(input) ? varied_direction(input) : direction_of(entry_of(input.word));
    }

    // The shading normal, in the space of the shape; zero where the shape has none.
    Vec3<Float<W>> normal(const ShapeLanes<W>& shape) const {
        return if_any(shape, direction_of(entry_of(m_code.words)));
    }
    // At the time of the hit.
    Vec3<Float<W>> normal(const ShapeLanes<W>& shape, const MotionLanes<W>& motion) const {
        const Entry here = entry_of(m_code.words);
        // A step's normals lie behind those of the step before: three floats, or a word a vertex.
        const Int<W> each = kanuka::select(here.stride == Int<W>(0), Int<W>(3),
                                           (shape.nu + Int<W>(1)) * (shape.nv + Int<W>(1)));
        const Int<W> base = kanuka::select(motion.moving, here.base + each * motion.segment, here.base);
        const Vec3<Float<W>> a = direction_of({base, here.stride});
        const Vec3<Float<W>> b =
            direction_of({kanuka::select(motion.moving, base + each, base), here.stride});
        return if_any(shape, kanuka::select(motion.moving, a + (b - a) * motion.f, a));
    }
    // Likewise at a vertex, of lanes whose normals vary.
    Vec3<Float<W>> normal_of(Int<W> vertex, Mask<W> m) const {
        const Entry e = entry_of(m_code.words);
        return decode_oct(gather(m_code.page_words, kanuka::select(m, e.base + vertex, Int<W>(0))));
    }
    // The direction of dPdu, in the same space; of programs that need it.
    Vec3<Float<W>> tangent() const { return direction_of(entry_of(m_code.words + 1)); }

  private:
    struct Entry { // of a slot table
        Int<W> base, stride;
    };
    Entry entry_of(Int<W> number) const {
        // And the next entry, or inputs.
        const auto row = load_rows<4>(m_code.page_words, m_table + (number << 1));
        return {bitcast_int(row[0]), bitcast_int(row[1])};
    }
    Entry entry_of(int number) const { return entry_of(Int<W>(number)); }

    // ---- the same for all instances

    // Schema defaults are greys: their spectra are constants.
    Spectrum<W> plain_color(const Place& input) const {
        return input.word < 0 ? Spectrum<W>(Float<W>(input.fallback.x))
                              : color_of(input, entry_of(input.word));
    }
    Float<W> plain_number(const Place& input) const {
        return input.word < 0 ? Float<W>(input.fallback.x) : number_of(input, entry_of(input.word));
    }
    Spectrum<W> plain_amount(const Place& input) const { return amount_of(entry_of(input.word)); }
    Float<W> plain_exact(const Place& input) const {
        return input.word < 0 ? Float<W>(input.fallback.x) : exact_of(entry_of(input.word));
    }

    // ---- what differs between instances; out of the way of scenes where nothing does

    bool differs(const Place& input) const { return m_look && input.varies != Place::Varies::No; }

    // What read(entry) gives of the two variants that an instance lies between, blended.
    template <class Read>
    auto between_variants(const Place& input, const Read& read) const {
        if (m_code.variants == 1)
            return read(entry_of(input.word));
        const Float<W> last(float(m_code.variants - 1));
        const Float<W> variant = min(m_look->variant, last);
        const Int<W> lower = to_int(variant), upper = min(lower + Int<W>(1), Int<W>(m_code.variants - 1));
        const auto at = [&](Int<W> v) {
            const Int<W> beyond = Int<W>(m_code.first_entry(1)) + (v - Int<W>(1)) * Int<W>(m_code.words);
            return entry_of(kanuka::select(v == Int<W>(0), Int<W>(0), beyond) + Int<W>(input.word));
        };
        Float<W> f = variant - Float<W>(lower);
        if (input.between != grid::Between::Linear) // what has nothing between, or more than one way there
            f = kanuka::select(f < Float<W>(0.5f), Float<W>(0.0f), Float<W>(1.0f));
        const auto a = read(at(lower));
        if (!any(f > Float<W>(0.0f)))
            return a;
        return a * (Float<W>(1.0f) - f) + read(at(upper)) * f;
    }
    [[gnu::noinline]] Spectrum<W> varied_color(const Place& input) const {
        Spectrum<W> s = input.word < 0
                            ? plain_color(input)
                            : between_variants(input, [&](const Entry& e) { return color_of(input, e); });
        const Float<W> zero(0.0f), one(1.0f);
        if (input.varies == Place::Varies::Rougher)
            for (int k = 0; k < Wavelengths; k++)
                s[k] = clamp(s[k] + m_look->roughness, zero, one);
        return input.varies == Place::Varies::Tinted ? tinted(s, one) : s;
    }
    [[gnu::noinline]] Float<W> varied_number(const Place& input) const {
        const Float<W> x = input.word < 0
                               ? plain_number(input)
                               : between_variants(input, [&](const Entry& e) { return number_of(input, e); });
        return input.varies == Place::Varies::Rougher
                   ? clamp(x + m_look->roughness, Float<W>(0.0f), Float<W>(1.0f))
                   : x;
    }
    [[gnu::noinline]] Spectrum<W> varied_amount(const Place& input) const {
        const Spectrum<W> s = between_variants(input, [&](const Entry& e) { return amount_of(e); });
        return input.varies == Place::Varies::Tinted ? tinted(s, Float<W>(1e30f)) : s;
    }
    [[gnu::noinline]] Float<W> varied_exact(const Place& input) const {
        return input.word < 0 ? plain_exact(input)
                              : between_variants(input, [&](const Entry& e) { return exact_of(e); });
    }
    [[gnu::noinline]] Vec3<Float<W>> varied_direction(const Place& input) const {
        return between_variants(input, [&](const Entry& e) { return direction_of(e); });
    }
    Spectrum<W> tinted(Spectrum<W> s, Float<W> most) const {
        if (!any(m_look->tinted))
            return s;
        Spectrum<W> t = bsdf::sigmoid_spectrum(m_look->c0, m_look->c1, m_look->c2, m_l) * m_look->scale;
        if (!m_scene.spectra.tables.empty())
            t = select_measured(m_scene, m_look->c0, m_look->c1, m_look->scale, m_l, t);
        for (int k = 0; k < Wavelengths; k++)
            s[k] = kanuka::select(m_look->tinted, min(s[k] * t[k], most), s[k]);
        return s;
    }

    // ---- an input by its entry

    Spectrum<W> color_of(const Place& input, const Entry& entry) const {
        const auto& [base, stride] = entry;
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

    Float<W> number_of(const Place& input, const Entry& entry) const {
        const auto& [base, stride] = entry;
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

    Spectrum<W> amount_of(const Entry& entry) const {
        const auto& [base, stride] = entry;
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

    Float<W> exact_of(const Entry& entry) const {
        const auto& [base, stride] = entry;
        const Mask<W> constant = stride == Int<W>(0);
        Float<W> sum(0.0f);
        for (int k = 0; k < 4; k++)
            sum =
                fma(m_place.weight[k], gather(m_code.page_floats(), base + stride * m_place.vertex[k]), sum);
        // The weights' sum is one but for rounding.
        return kanuka::select(constant, gather(m_code.page_floats(), base), sum);
    }

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

    static Vec3<Float<W>> if_any(const ShapeLanes<W>& shape, const Vec3<Float<W>>& n) {
        const Vec3<Float<W>> zero{Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)};
        return kanuka::select(shape.has(store::ShapeRecord::HasNormals), n, zero);
    }

    // A unit vector of the vertices around.
    Vec3<Float<W>> direction_of(const Entry& entry) const {
        const auto& [base, stride] = entry;
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
    const InstanceLook<W>* m_look;
};

} // namespace kanuka::transport
