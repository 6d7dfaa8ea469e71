// Thin walls, gratings, and reflection back to the light.
#pragma once

#include "bsdf/lobes_reflection.h"

namespace kanuka::bsdf {

// ---- a thin sheet of dielectric: what passes goes on in its direction, spread as much as what is reflected.
// Reflections between both sides add up without interference, R' = 2 R / (1 + R), or with it if the sheet is
// a film: Airy's sum.

template <int W>
struct ThinWallLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr LobeId Id = LobeId::ThinWalledDielectricBsdf;
    static constexpr int Reflectance = color_of(Id, "reflectance"),
                         Transmittance = color_of(Id, "transmittance"), Ior = number_of(Id, "ior"),
                         Roughness = number_of(Id, "roughness");

    static Spectrum<W> reflectance(const LobeInputs<W>& in, F cosine) {
        const F one(1.0f);
        F cos_t;
        const F R = fresnel_dielectric(cosine, in.eta[0], cos_t);
        Spectrum<W> r(F(2.0f) * R / (one + R));
        if (in.has_film) {
            const Mask<W> film = in.film > F(0.0f);
            for (int i = 0; i < Wavelengths; i++)
                r[i] = kanuka::select(
                    film, film_reflectance(cosine, in.eta[0], in.film / in.wavelength(i), one, F(0.0f)),
                    r[i]);
        }
        return r;
    }
    static void prepare(LobeInputs<W>& in, const V& wo) {
        in.eta = Spectrum<W>(max(in.number[Ior], F(1.0001f)));
        in.alpha = in.number[Roughness] * in.number[Roughness];
        in.rough = in.alpha > F(FewFacets);
        in.compensated = any(in.rough);
        in.has_film = in.has(input_of(Id, "thickness"));
        in.film = in.number[number_of(Id, "thickness")];
        if (in.compensated)
            in.balance = balance_of(in, wo);
    }
    static Spectrum<W> albedo(const LobeInputs<W>& in, F cosine) {
        const Spectrum<W> R = reflectance(in, softened(cosine, in.alpha));
        Spectrum<W> a;
        for (int i = 0; i < Wavelengths; i++)
            a[i] = in.color[Reflectance][i] * R[i] + in.color[Transmittance][i] * (F(1.0f) - R[i]);
        return a;
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const Mask<W> passes = wi.z < F(0.0f);
        const V up(wi.x, wi.y, abs(wi.z));
        const FacetTerms<W> t = facet_reflection(ggx_of(in), in, wo, up);
        LobeValue<W> v = choice(in, reflectance(in, t.cos_m), passes);
        v.pdf = v.pdf * t.pdf;
        v.f = v.f * (in.compensated ? t.f * in.balance * balance_of(in, up) : t.f);
        return v;
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, F u_choice, F u0,
                                                  F u1) {
        const V m = sample_facet(ggx_of(in), in, wo, u0, u1);
        const Spectrum<W> R = reflectance(in, max(dot(wo, m), F(0.0f)));
        const Mask<W> passes = u_choice >= mean(R);
        LobeSample<W> s = sample_of(reflect(wo, m));
        s.valid = s.wi.z > F(0.0f);
        s.wi.z = kanuka::select(passes, -s.wi.z, s.wi.z);
        s.delta = in.alpha < F(SmoothAlpha);
        s.value = choice(in, R, passes);
        return s;
    }

    static LobeValue<W> straight(const LobeInputs<W>& in, const V& wo) {
        const Mask<W> smooth = in.alpha < F(SmoothAlpha);
        const LobeValue<W> v = choice(in, reflectance(in, wo.z), Mask<W>(true));
        return {select(smooth, v.f, no_value<W>().f), select(smooth, v.pdf, no_value<W>().f)};
    }

  private:
    // Both ways go to the same directions for all wavelengths, so one chance serves them all: the mean.
    static LobeValue<W> choice(const LobeInputs<W>& in, const Spectrum<W>& R, Mask<W> passes) {
        const F one(1.0f), q = mean(R);
        LobeValue<W> v;
        v.pdf = Spectrum<W>(kanuka::select(passes, one - q, q));
        for (int i = 0; i < Wavelengths; i++)
            v.f[i] = kanuka::select(passes, (one - R[i]) * in.color[Transmittance][i],
                                    R[i] * in.color[Reflectance][i]);
        return v;
    }
};

// ---- a grating: grooves along the axis, as deep as `depth`, half as wide as their period. Order m leaves
// with its component across the grooves shifted by m lambda / period (the grating equation); square grooves
// send cos^2(phi / 2) of light into order 0 and sin^2(phi / 2) into the odd orders, by 1 / m^2, phi = 4 pi
// depth / lambda. Roughness blurs orders in the plane of direction cosines, by a Gaussian.

template <int W>
struct GratingLobe {
    using F = Float<W>;
    using V = Vec3<F>;
    static constexpr LobeId Id = LobeId::GratingBrdf;
    static constexpr int Reflectance = color_of(Id, "reflectance"), Roughness = number_of(Id, "roughness"),
                         Period = number_of(Id, "period"), Depth = number_of(Id, "depth"),
                         Rotation = number_of(Id, "rotation");
    static constexpr int Orders[] = {0, 1, -1, 3, -3, 5, -5};
    static constexpr float Odd = 0.5f / (1 + 1 / 9.0f + 1 / 25.0f);

    static void prepare(LobeInputs<W>& in) {
        in.alpha = max(in.number[Roughness] * in.number[Roughness] * F(1 / 3.0f), F(0.003f));
        const F turn = in.number[Rotation];
        F s, c;
        sincos_2pi(turn - floor(turn), s, c);
        in.axis_x = c, in.axis_y = s;
        in.dispersive = true;
        const F period = max(in.number[Period], F(1.0f)), depth = max(in.number[Depth], F(0.0f));
        for (int i = 0; i < Wavelengths; i++) {
            in.eta[i] = in.wavelength(i) / period;    // shift of order 1
            const F turns = depth / in.wavelength(i); // phi / 2 = 2 pi of these
            sincos_2pi(turns - floor(turns), s, c);
            in.dip[i] = s * s; // odd orders together
        }
    }
    static F efficiency(const LobeInputs<W>& in, int order, int i) {
        return order == 0 ? F(1.0f) - in.dip[i] : in.dip[i] * F(Odd / float(order * order));
    }
    // What goes into orders that leave the surface.
    static Spectrum<W> albedo(const LobeInputs<W>& in, const V& wo) {
        const V o = to_axis(in, wo);
        Spectrum<W> a;
        for (int i = 0; i < Wavelengths; i++) {
            F sum(0.0f);
            for (int order : Orders) {
                const F y = fma(F(float(order)), in.eta[i], -o.y);
                const F room =
                    (F(1.0f) - sqrt(fma(o.x, o.x, y * y))) / in.alpha; // to the horizon; erf, nearly
                sum +=
                    efficiency(in, order, i) / (F(1.0f) + exp(clamp(room * F(-2.4f), F(-40.0f), F(40.0f))));
            }
            a[i] = in.color[Reflectance][i] * sum;
        }
        return a;
    }
    [[gnu::noinline]] static LobeValue<W> eval(const LobeInputs<W>& in, const V& wo, const V& wi) {
        const V o = to_axis(in, wo), w = to_axis(in, wi);
        const F zero(0.0f), x = o.x + w.x, y = o.y + w.y, a2 = in.alpha * in.alpha;
        LobeValue<W> v;
        for (int i = 0; i < Wavelengths; i++) {
            F sum(0.0f);
            for (int order : Orders) {
                const F dy = y - F(float(order)) * in.eta[i];
                sum += efficiency(in, order, i) * exp(-fma(x, x, dy * dy) / a2);
            }
            v.pdf[i] = kanuka::select(w.z > zero, sum * F(InvPi) / a2 * w.z, zero);
        }
        v.f = v.pdf * in.color[Reflectance];
        return v;
    }
    [[gnu::noinline]] static LobeSample<W> sample(const LobeInputs<W>& in, const V& wo, F u_choice, F u0,
                                                  F u1) {
        const V o = to_axis(in, wo);
        F from(0.0f), order(0.0f);
        for (int m : Orders) {
            order = kanuka::select(u_choice >= from, F(float(m)), order);
            from += efficiency(in, m, 0);
        }
        F s, c;
        sincos_2pi(u0, s, c);
        const F one(1.0f), r = in.alpha * sqrt(log2(max(one - u1, F(1e-7f))) * F(-0.693147181f));
        const F x = fma(r, c, -o.x), y = fma(r, s, fma(order, in.eta[0], -o.y));
        const F z2 = one - fma(x, x, y * y);
        LobeSample<W> out = sample_of(from_axis(in, V(x, y, sqrt(max(z2, F(1e-12f))))));
        out.valid = z2 > F(1e-10f);
        out.wi = kanuka::select(out.valid, out.wi, V(F(0.0f), F(0.0f), one));
        return out;
    }
};

} // namespace kanuka::bsdf
