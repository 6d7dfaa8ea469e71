// A material at a hit: what it takes to sample light and directions there.
#pragma once

#include "base/sampling.h"
#include "transport/lights.h"
#include "transport/surface_hit.h"

namespace kanuka::transport {

template <int W>
struct DirectionSample : bsdf::LobeSample<W> {
    Mask<W> through{false}; // the lobe transmits
};

// A hit's material, and what it takes to sample light and directions there.
template <int W>
struct Scattering {
    const Bounce& at;
    const SurfaceHit<W>& h;
    Vec3<Float<W>> wo, ng; // in the frame of the hit: the view, and the normal of the horizon
    Vec3<Float<W>> normals[bsdf::MaxLobes]; // of lobes that have their own
    bsdf::Material<W> material;
    Sampler<W> sampler;
    Receiver<W> receiver;
    LightChooser<W> chooser;

    Scattering(const Bounce& at, const SurfaceHit<W>& h)
        : at(at), h(h), wo(local_view(h)), ng(h.to_local(h.horizon)),
          material(h.code, h.fetch, h.outside, wo, h.l, at.scene.media.tracked ? &h.crossing.outer : nullptr,
                   own_normals()),
          sampler{bitcast_int(h.ray[PathQueue::PixelHash]), at.reversed_progression},
          receiver(receiver_at(at, h)), chooser(at.scene, receiver) {}

    // Is there a lobe for light from wi? `above`: its cosine to the horizon's normal as SurfaceHit::offset()
    // has it, so that rounding does not put a ray's start on one side and its value on the other.
    Mask<W> reaches(const Vec3<Float<W>>& wi, Float<W> above) const {
        return max(wi.z * above, mirrored(wi, above).z * above) > Float<W>(0.0f);
    }
    // What the material makes of light from wi, a direction in the frame of the hit, on whatever side of the
    // surface it lies. A lobe that leans with its shading normal has a part on the wrong side; a mirror that
    // lies in the surface brings it back. So nothing is lost, whatever the lobes, and the density is that of
    // sample(). It is the perfect mirror for a tangent facet of Schüssler, Heitz, Hanika and Dachsbacher 2017
    // (Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing, section 4), put into the surface,
    // which serves transmission and layers, too. Without a lean there is no such part.
    bsdf::LobeValue<W> eval(const Vec3<Float<W>>& wi, Float<W> above, Mask<W> m) const {
        using F = Float<W>;
        const Vec3<F> image = mirrored(wi, above);
        bsdf::LobeValue<W> value = material.eval(wo, wi);
        const Mask<W> own = wi.z * above > F(0.0f), folded = m & (image.z * above > F(0.0f));
        mask(value, own);
        if (any(folded))
            add(value, image, folded);
        return value;
    }
    // The part of eval() that diffuse lobes have.
    [[gnu::noinline]] bsdf::Spectrum<W> diffuse_part(const Vec3<Float<W>>& wi, Float<W> above,
                                                     Mask<W> m) const {
        using F = Float<W>;
        const Vec3<F> image = mirrored(wi, above);
        const Mask<W> own = wi.z * above > F(0.0f), folded = m & (image.z * above > F(0.0f));
        const Spectrum<W> none(F(0.0f));
        Spectrum<W> f = bsdf::select(own, material.eval_some(h.code.diffuse, wo, wi), none);
        if (any(folded))
            f += bsdf::select(folded, material.eval_some(h.code.diffuse, wo, image), none);
        return f;
    }
    // A direction of the material, brought to the side of the surface that its lobe means.
    DirectionSample<W> sample(Float<W> u_lobe, Float<W> u0, Float<W> u1, Mask<W> m) const {
        using F = Float<W>;
        DirectionSample<W> s{material.sample(wo, u_lobe, u0, u1)};
        Mask<W> aimed(false);
        if (h.code.aimed != 0) {
            aimed = s.valid & s.delta & ((Int<W>(int(h.code.aimed)) & (Int<W>(1) << s.leaf)) != Int<W>(0));
            s.wi = select(aimed, h.aim(at, s.leaf), s.wi);
        }
        const F above = dot(s.wi, ng);
        const Vec3<F> image = mirrored(s.wi, above);
        const Mask<W> folded = (s.wi.z * above < F(0.0f)) & !aimed, both = image.z * s.wi.z > F(0.0f);
        if (const Mask<W> more = m & s.valid & both & !s.delta; any(more))
            add(s.value, image, more);
        s.through = select(aimed, above, s.wi.z) < F(0.0f);
        s.wi = select(folded, image, s.wi);
        s.valid &= abs(above) > F(1e-6f); // else rounding decides where it starts
        return s;
    }

  private:
    const Vec3<Float<W>>* own_normals() {
        if (!h.code.turned)
            return nullptr;
        h.lobe_normals(at, normals);
        return normals;
    }
    Vec3<Float<W>> mirrored(const Vec3<Float<W>>& w, Float<W> above) const {
        return w - ng * (above + above);
    }
    static void mask(bsdf::LobeValue<W>& value, Mask<W> m) {
        value.f = bsdf::select(m, value.f, Spectrum<W>(Float<W>(0.0f)));
        value.pdf = bsdf::select(m, value.pdf, Spectrum<W>(Float<W>(0.0f)));
    }
    [[gnu::noinline]] void add(bsdf::LobeValue<W>& value, const Vec3<Float<W>>& wi, Mask<W> m) const {
        bsdf::LobeValue<W> more = material.eval(wo, wi);
        mask(more, m);
        value.f += more.f;
        value.pdf += more.pdf;
    }
    static Vec3<Float<W>> local_view(const SurfaceHit<W>& h) {
        Vec3<Float<W>> wo = h.to_local(-h.d);
        wo.z = h.cos_o;
        return wo;
    }
    static Receiver<W> receiver_at(const Bounce& at, const SurfaceHit<W>& h) {
        Receiver<W> r{h.P, h.N, Mask<W>(true)};
        // What leans with its normal has light from beyond that normal's horizon, too.
        const Mask<W> leans =
            Mask<W>(at.scene.lights.points_in_tree) & (dot(h.N, h.horizon) < Float<W>(0.9995f));
        if (any(leans)) {
            r.N = select(leans, Vec3<Float<W>>(Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)), r.N);
            r.oriented = !leans;
        }
        if (h.code.transmits)
            r.N = {Float<W>(0.0f), Float<W>(0.0f), Float<W>(0.0f)}, r.oriented = Mask<W>(false);
        if (at.scene.lights.linked)
            r.set = links_of(at.scene, bitcast_int(h.hit[HitState::Shape]), &store::Links::lit_sets);
        return r;
    }
};

} // namespace kanuka::transport
