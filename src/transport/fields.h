// Interiors that are thicker here than there. Rays meet imaginary particles, evenly thick all through; which
// of them are real the density says where they lie (delta tracking: Woodcock 1965). What that does to
// wavelengths other than the hero is the ratio of their chances, as ever (spectral MIS with null collisions:
// Miller, Georgiev and Jarosz 2019, A null-scattering path integral formulation of light transport).
#pragma once

#include "transport/medium_lanes.h"

namespace kanuka::transport {

// In SceneView::fields, values of the lattice behind it. Numbers are floats, but `First` is the bits of an
// integer.
struct FieldRow {
    enum Word { UnitFromRender = 0, SizeX = 12, SizeY = 13, SizeZ = 14, Shape = 15, Words = 16 };
};

// A ray in a field, as lanes read it.
template <int W>
class FieldLanes {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;

  public:
    FieldLanes(const SceneView& scene, I field, const V& o, const V& d)
        : m_values(scene.fields.data()), m_first(field + I(FieldRow::Words)) {
        const auto row = load_rows<FieldRow::Words>(m_values, field);
        for (size_t r = 0; r < 3; r++) {
            m_o[int(r)] =
                fma(row[4 * r], o.x, fma(row[4 * r + 1], o.y, fma(row[4 * r + 2], o.z, row[4 * r + 3])));
            m_d[int(r)] = fma(row[4 * r], d.x, fma(row[4 * r + 1], d.y, row[4 * r + 2] * d.z));
            m_size[int(r)] = row[FieldRow::SizeX + r];
        }
        m_shape = row[FieldRow::Shape];
    }

    // Where the ray is in the box.
    void clip(F& from, F& to) const {
        for (int c = 0; c < 3; c++) {
            const F inverse = F(1.0f) / select(abs(m_d[c]) < F(1e-20f), F(1e-20f), m_d[c]);
            const F a = -m_o[c] * inverse, b = (F(1.0f) - m_o[c]) * inverse;
            from = max(from, min(a, b));
            to = min(to, max(a, b));
        }
    }

    // Trilinear in the values of the lattice.
    F density(F t) const {
        const V p = m_o + m_d * t;
        I at[3], step[3];
        F part[3];
        I stride(1);
        for (int c = 0; c < 3; c++) {
            const F last = m_size[c] - F(1.0f);
            const F x = clamp(p[c], F(0.0f), F(1.0f)) * last;
            const F cell = min(floor(x), max(last - F(1.0f), F(0.0f)));
            part[c] = x - cell;
            at[c] = to_int(cell) * stride;
            step[c] = select(last > F(0.0f), stride, I(0));
            stride = stride * to_int(m_size[c]);
        }
        const I base = m_first + at[0] + at[1] + at[2];
        const auto along_x = [&](I k) {
            const F a = gather(m_values, k), b = gather(m_values, k + step[0]);
            return fma(part[0], b - a, a);
        };
        const F x0 = along_x(base), x1 = along_x(base + step[1]), x2 = along_x(base + step[2]),
                x3 = along_x(base + step[1] + step[2]);
        const F y0 = fma(part[1], x1 - x0, x0), y1 = fma(part[1], x3 - x2, x2);
        return select(within(p), fma(part[2], y1 - y0, y0), F(0.0f));
    }

  private:
    Mask<W> within(const V& p) const {
        using S = store::DensityField;
        const V q(fma(p.x, F(2.0f), F(-1.0f)), fma(p.y, F(2.0f), F(-1.0f)), fma(p.z, F(2.0f), F(-1.0f)));
        const F across = fma(q.x, q.x, q.y * q.y), tip = F(1.0f) - p.z;
        return (m_shape == F(float(S::Box))) |
               ((m_shape == F(float(S::Ellipsoid))) & (fma(q.z, q.z, across) <= F(1.0f))) |
               ((m_shape == F(float(S::Cylinder))) & (across <= F(1.0f))) |
               ((m_shape == F(float(S::Cone))) & (across <= tip * tip));
    }

    const float* m_values;
    I m_first;
    V m_o, m_d, m_size;
    F m_shape;
};

// One stream of random numbers a way through a medium: the same however often it is gone.
template <int W>
Int<W> way_seed(Int<W> of_path, uint32_t reversed_progression) {
    return hash_bits(of_path ^ Int<W>(int(reversed_progression * 0x9e3779b9u + 0x51ed270bu)));
}

// What imaginary particles did on the way.
template <int W>
struct Nulls {
    Spectrum<W> change{Float<W>(1.0f)}; // of each wavelength's weight and chance, relative to the hero's
    Float<W> mis{1.0f};                 // one over the hero's chance of passing them
    Float<W> reach{1e30f};              // where a real particle was met
};

// Calls event(t, density, u, active) at imaginary particles between from and to, met at the rate `thickness`
// per metre; it says where the way goes on.
template <int W, class Event>
void visit_particles(const SceneView& scene, Int<W> field, const Vec3<Float<W>>& o, const Vec3<Float<W>>& d,
                     Float<W> from, Float<W> to, Float<W> thickness, Int<W> seed, Mask<W> active,
                     Event event) {
    using F = Float<W>;
    using I = Int<W>;
    constexpr int Most = 1 << 12; // then it is as good as solid
    const FieldLanes<W> lanes(scene, field, o, d);
    lanes.clip(from, to);
    const F mean_free = F(1.0f) / max(thickness, F(1e-30f));
    F t = from;
    active &= (thickness > F(0.0f)) & (from < to);
    for (int k = 0; k < Most && any(active); k++) {
        const I h = hash_bits(seed + I(int(uint32_t(k) * 0x9e3779b9u)));
        t = t - log2(F(1.0f) - to_unit(h)) * F(0.693147181f) * mean_free;
        active &= t < to;
        if (any(active))
            active &= event(t, lanes.density(t), to_unit(hash_bits(h ^ I(0x68bc21eb))), active);
    }
}

// From the origin's `from` to `to` in a medium with a field: up to the first real particle, by the hero's
// chance.
template <int W>
[[gnu::noinline]] Nulls<W> pass_particles(const SceneView& scene, const MediumLanes<W>& medium,
                                          const Vec3<Float<W>>& o, const Vec3<Float<W>>& d, Float<W> from,
                                          Float<W> to, Int<W> seed, Mask<W> active) {
    using F = Float<W>;
    Nulls<W> nulls;
    const F most = medium.thickest();
    visit_particles(scene, select(active, medium.field, Int<W>(0)), o, d, from, to, most, seed, active,
                    [&](F t, F density, F u, Mask<W> here) {
                        const F hero = medium.extinction(0) * density;
                        const Mask<W> real = here & (u * most < hero), null = here & !real;
                        const F chance = F(1.0f) / max(most - hero, F(1e-30f));
                        for (int i = 0; i < Wavelengths; i++)
                            nulls.change[i] = select(
                                null, nulls.change[i] * ((most - medium.extinction(i) * density) * chance),
                                nulls.change[i]);
                        nulls.mis = select(null, nulls.mis * (most * chance), nulls.mis);
                        nulls.reach = select(real, t, nulls.reach);
                        return null;
                    });
    return nulls;
}

// An estimate of how much light goes all the way (ratio tracking: Novak et al. 2014): of each wavelength.
template <int W>
[[gnu::noinline]] Spectrum<W> through_particles(const SceneView& scene, const MediumLanes<W>& medium,
                                                const Vec3<Float<W>>& o, const Vec3<Float<W>>& d,
                                                Float<W> from, Float<W> to, Int<W> seed, Mask<W> active) {
    using F = Float<W>;
    Spectrum<W> through(F(1.0f));
    const F most = medium.thickest(), per = F(1.0f) / max(most, F(1e-30f));
    visit_particles(scene, select(active, medium.field, Int<W>(0)), o, d, from, to, most, seed, active,
                    [&](F, F density, F, Mask<W> here) {
                        F left(0.0f);
                        for (int i = 0; i < Wavelengths; i++) {
                            through[i] =
                                select(here, through[i] * (F(1.0f) - medium.extinction(i) * density * per),
                                       through[i]);
                            left = max(left, through[i]);
                        }
                        return here & (left > F(1e-6f));
                    });
    return through;
}

} // namespace kanuka::transport
