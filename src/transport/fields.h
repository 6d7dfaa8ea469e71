// Interiors that are thicker here than there. Collisions are sampled by a majorant of the extinction, which
// is constant within the cells of a coarse grid; which of them are real the density says where they lie
// (delta tracking: Woodcock 1965; majorants a cell: Szirmay-Kalos, Toth and Magdics 2011, Free path sampling
// in high resolution inhomogeneous participating media). What null collisions do to wavelengths other than
// the hero is the ratio of their chances (Miller, Georgiev and Jarosz 2019, A null-scattering path integral
// formulation of light transport).
#pragma once

#include "transport/medium_lanes.h"
#include "transport/seeds.h"

namespace kanuka::transport {

// In MediaView::fields; behind it the values of the lattice, then the majorants of the cells.
struct FieldRow {
    enum Word { UnitFromRender = 0, SizeX = 12, Shape = 15, CellsX = 16, Words = 20 };
};

// A ray in a field, as lanes read it.
template <int W>
class FieldLanes {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;

  public:
    FieldLanes(const SceneView& scene, I field, const V& o, const V& d)
        : m_values(scene.media.fields.data()), m_first(field + I(FieldRow::Words)) {
        const auto row = load_rows<FieldRow::CellsX>(m_values, field);
        const auto cells =
            load_rows<FieldRow::Words - FieldRow::CellsX>(m_values, field + I(FieldRow::CellsX));
        for (size_t r = 0; r < 3; r++) {
            m_o[int(r)] =
                fma(row[4 * r], o.x, fma(row[4 * r + 1], o.y, fma(row[4 * r + 2], o.z, row[4 * r + 3])));
            m_d[int(r)] = fma(row[4 * r], d.x, fma(row[4 * r + 1], d.y, row[4 * r + 2] * d.z));
            m_size[int(r)] = row[FieldRow::SizeX + r];
            m_cells[int(r)] = cells[r];
        }
        m_shape = row[FieldRow::Shape];
        m_majorants = m_first + to_int(m_size.x) * to_int(m_size.y) * to_int(m_size.z);
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

    // The cells of the majorant that the ray passes, one after the other (Amanatides and Woo 1987).
    class Cells {
      public:
        Cells(const FieldLanes& field, F t) : m_field(field) {
            for (int c = 0; c < 3; c++) {
                const F n = field.m_cells[c], d = field.m_d[c];
                const F p = clamp(field.m_o[c] + d * t, F(0.0f), F(1.0f)) * n;
                const Mask<W> along = d > F(0.0f), still = abs(d) < F(1e-20f);
                const F inverse = F(1.0f) / select(still, F(1.0f), d * n);
                m_at[c] = min(floor(p), n - F(1.0f));
                m_step[c] = select(along, F(1.0f), F(-1.0f));
                m_width[c] = abs(inverse);
                m_end[c] = select(still, F(1e30f),
                                  (m_at[c] + select(along, F(1.0f), F(0.0f)) - field.m_o[c] * n) * inverse);
            }
        }
        // Of the cell, relative to the most there is anywhere.
        F majorant() const {
            const auto& n = m_field.m_cells;
            const F at = fma(fma(m_at.z, n.y, m_at.y), n.x, m_at.x);
            return gather(m_field.m_values, m_field.m_majorants + to_int(at));
        }
        // Where the ray leaves the cell.
        F end() const { return min(min(m_end.x, m_end.y), m_end.z); }
        void next(Mask<W> m) {
            const F first = end();
            for (int c = 0; c < 3; c++) {
                const Mask<W> here = m & (m_end[c] <= first);
                const F last = m_field.m_cells[c] - F(1.0f);
                m_at[c] = select(here, clamp(m_at[c] + m_step[c], F(0.0f), last), m_at[c]);
                m_end[c] = select(here, m_end[c] + m_width[c], m_end[c]);
            }
        }

      private:
        const FieldLanes& m_field;
        V m_at, m_step, m_width, m_end;
    };

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
    I m_first, m_majorants;
    V m_o, m_d, m_size, m_cells;
    F m_shape;
};

// How much extinction lies before the next collision.
template <int W>
Float<W> optical_depth(Int<W> random_bits) {
    return log2(Float<W>(1.0f) - to_unit(random_bits)) * Float<W>(-0.693147181f);
}

// What null collisions along a segment did.
template <int W>
struct NullCollisions {
    Spectrum<W> change{Float<W>(1.0f)}; // of each wavelength's throughput and density, relative to the hero's
    Float<W> mis{1.0f};                 // one over the hero's chance of passing them
    Float<W> reach{1e30f};              // the distance of the first real collision
};

// Collisions and cells that a ray visits at most. Beyond, densities change so much from place to place that
// sampling by their bounds comes to no end; the rest of the ray is marched, which is no longer unbiased: what
// varies within a step is seen too thin.
// Where a ray would visit many times as many, FewVisits decide whether it comes to an end early.
inline constexpr int MostVisits = 2048, FewVisits = 256, MarchSteps = 256;
template <int W>
Mask<W> is_endless(Float<W> thickest, Float<W> length) {
    return thickest * length > Float<W>(16.0f * MostVisits);
}

// Calls event(t, majorant, density, u, active) at collisions from t on to `to`, which `thickest` times the
// cells' majorants sample; it says who goes on. `endless`: rays that get FewVisits. Returns the rays that
// have not reached the end, and in t how far they came.
template <int W, class Event>
Mask<W> visit_collisions(const FieldLanes<W>& field, Float<W>& t, Float<W> to, Float<W> thickest,
                         Mask<W> endless, Int<W> seed, Mask<W> active, Event event) {
    using F = Float<W>;
    using I = Int<W>;
    typename FieldLanes<W>::Cells cells(field, t);
    I count(0);
    const auto random = [&] { return hash_bits(seed + count * I(int(0x9e3779b9u))); };
    I h = random();
    F depth = optical_depth<W>(h); // up to the next collision
    Mask<W> rest(false);
    for (int k = 0; k < MostVisits && any(active); k++) {
        if (k == FewVisits) {
            rest = active & endless;
            active &= !endless;
        }
        const F majorant = thickest * cells.majorant(), end = min(cells.end(), to);
        const F at = t + depth / max(majorant, F(1e-30f));
        const Mask<W> collides = active & (at < end), leaves = active & !collides;
        if (any(collides)) {
            const Mask<W> on = event(at, majorant, field.density(at),
                                     to_unit(hash_bits(h ^ I(seeds::IsRealCollision))), collides);
            active &= leaves | on;
            t = select(collides, at, t);
            count = select(collides, count + I(1), count);
            h = random();
            depth = select(collides, optical_depth<W>(h), depth);
        }
        if (any(leaves)) {
            depth = select(leaves, max(depth - (end - t) * majorant, F(0.0f)), depth);
            t = select(leaves, max(end, t), t);
            active &= collides | (end < to);
            cells.next(leaves);
        }
    }
    return active | rest;
}

// Calls step(t, length, density, active) for even parts of what lies between t and the end of the box, up to
// `to`; it says who goes on. The parts do not go by `to`: a ray that is marched again, to where it ended, has
// the same.
template <int W, class Step>
void march(const FieldLanes<W>& field, Float<W> t, Float<W> box_end, Float<W> to, Mask<W> active, Step step) {
    using F = Float<W>;
    const F length = (box_end - t) * F(1.0f / MarchSteps);
    for (int k = 0; k < MarchSteps && any(active); k++) {
        const F from = fma(length, F(float(k)), t);
        active &= from < to;
        active &= step(from, min(length, to - from), field.density(fma(length, F(0.5f), from)), active);
    }
}

// From the origin's `from` to `to` in a medium with a field: up to the first real collision, by the hero's
// chance.
template <int W>
[[gnu::noinline]] NullCollisions<W> delta_track(const SceneView& scene, const MediumLanes<W>& medium,
                                                const Vec3<Float<W>>& o, const Vec3<Float<W>>& d,
                                                Float<W> from, Float<W> to, Int<W> seed, Mask<W> active) {
    using F = Float<W>;
    NullCollisions<W> nulls;
    const FieldLanes<W> field(scene, select(active, medium.field, Int<W>(0)), o, d);
    F box_end(1e30f);
    field.clip(from, box_end);
    const F most = medium.thickest(), end = min(box_end, to), hero = medium.extinction(0);
    F t = from;
    active &= (most > F(0.0f)) & (from < end);
    const Mask<W> rest = visit_collisions(
        field, t, end, most, is_endless(most, box_end - from), seed, active,
        [&](F at, F majorant, F density, F u, Mask<W> here) {
            const F of_hero = hero * density;
            // What is real but for rounding is real: the weight of passing it would have no bound.
            const Mask<W> real = here & ((u * majorant < of_hero) | (of_hero >= majorant * F(1 - 1e-6f))),
                          null = here & !real;
            const F chance = F(1.0f) / max(majorant - of_hero, F(1e-30f));
            for (int i = 0; i < Wavelengths; i++) {
                const F kept = max(majorant - medium.extinction(i) * density, F(0.0f));
                nulls.change[i] = select(null, nulls.change[i] * (kept * chance), nulls.change[i]);
            }
            nulls.mis = select(null, nulls.mis * (majorant * chance), nulls.mis);
            nulls.reach = select(real, at, nulls.reach);
            return null;
        });
    if (!any(rest))
        return nulls;
    F left = optical_depth<W>(hash_bits(seed ^ Int<W>(seeds::MarchedDepth)));
    march(field, t, box_end, end, rest, [&](F at, F length, F density, Mask<W> here) {
        const F of_hero = hero * density, s = min(length, left / max(of_hero, F(1e-30f)));
        const Mask<W> real = here & (s < length);
        for (int i = 0; i < Wavelengths; i++)
            nulls.change[i] = select(
                here, nulls.change[i] * exp(min((of_hero - medium.extinction(i) * density) * s, F(80.0f))),
                nulls.change[i]);
        nulls.mis = select(here, nulls.mis * exp(min(of_hero * s, F(80.0f))), nulls.mis);
        nulls.reach = select(real, at + s, nulls.reach);
        left = select(here, left - of_hero * s, left);
        return !real;
    });
    return nulls;
}

// An estimate of each wavelength's transmittance (ratio tracking: Novak, Selle and Jarosz 2014).
template <int W>
[[gnu::noinline]] Spectrum<W> ratio_track(const SceneView& scene, const MediumLanes<W>& medium,
                                          const Vec3<Float<W>>& o, const Vec3<Float<W>>& d, Float<W> from,
                                          Float<W> to, Int<W> seed, Mask<W> active) {
    using F = Float<W>;
    Spectrum<W> transmittance(F(1.0f));
    const FieldLanes<W> field(scene, select(active, medium.field, Int<W>(0)), o, d);
    F box_end(1e30f);
    field.clip(from, box_end);
    const F most = medium.thickest(), end = min(box_end, to);
    F t = from;
    active &= (most > F(0.0f)) & (from < end);
    // By one factor a wavelength; lanes end where none is left.
    const auto lose = [&](Mask<W> here, auto&& factor) {
        F left(0.0f);
        for (int i = 0; i < Wavelengths; i++) {
            transmittance[i] =
                select(here, transmittance[i] * factor(medium.extinction(i)), transmittance[i]);
            left = max(left, transmittance[i]);
        }
        return here & (left > F(1e-6f));
    };
    const Mask<W> rest = visit_collisions(
        field, t, end, most, is_endless(most, box_end - from), seed, active,
        [&](F, F majorant, F density, F, Mask<W> here) {
            const F share = density / max(majorant, F(1e-30f));
            return lose(here, [&](F extinction) { return max(F(1.0f) - extinction * share, F(0.0f)); });
        });
    if (any(rest))
        march(field, t, box_end, end, rest, [&](F, F length, F density, Mask<W> here) {
            return lose(here, [&](F extinction) { return exp(-(extinction * density * length)); });
        });
    return transmittance;
}

} // namespace kanuka::transport
