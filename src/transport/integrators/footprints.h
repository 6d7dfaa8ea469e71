// Footprints: how wide rays are where they hit something, for a dicing oracle. Paths as those of `path`; at
// each hit one of two goes on to a light, for what is in its way throws a shadow there.
//
// A ray is a cone (Amanatides 1984, Ray Tracing with Cones), as wide as a pixel to begin with. Its spread
// after a rough lobe, or towards a light, goes by the density that the direction was sampled with. At smooth
// lobes it changes by the curvature of the surface, paraxially: mirrors and lenses magnify what is seen in
// them (Akenine-Möller et al. 2021, Improved Shader and Texture Level of Detail Using Ray Cones, section 4).
#pragma once

#include <cmath>
#include <vector>

#include "transport/footprint_log.h"
#include "transport/tracer.h"

namespace kanuka::transport::footprints {

inline constexpr IntegratorInfo info{"how wide rays are where they hit; what a dicing oracle is made of",
                                     {{{"bounces", 4, "how many hits of a path count"}}}};

template <int W>
class Integrator {
  public:
    explicit Integrator(const IntegratorValues& values)
        : m_bounces(int(values[0])), m_paths(size_t(BatchPadded)) {}

    void trace(Tracer<W>& tracer) {
        FootprintLog* const log = tracer.scene.settings.footprints;
        std::fill(m_paths.begin(), m_paths.end(), Cone{.spread = log ? log->pixel_spread() : 1e-3f});
        const int last = std::min(m_bounces - 1, tracer.scene.last_step());
        while (tracer.count() > 0 && tracer.bounce() <= last) {
            tracer.intersect();
            tracer.surfaces(
                [&](SurfaceStage<W>& stage, const bsdf::MaterialCode& code, Int<W> slots, Mask<W> active) {
                    SurfaceHit<W> hit(stage.at(), code, slots);
                    arrive(stage, hit, log, active);
                    stage.arrive(hit, active);
                    if (!stage.scatters(code))
                        return;
                    const Scattering<W> s(stage.at(), hit);
                    const Mask<W> asked = select_half(stage, hit, active), lit = go_to_light(stage, s, asked);
                    stage.sample_direction(s, active & !lit, Mask<W>(false));
                });
        }
    }

  private:
    struct Cone {
        float width = 0, spread = 0;        // where the ray began; negative where it has crossed over
        float reflected = 0, refracted = 0; // its spread after a smooth lobe of the last surface
        Vec3f normal{0, 0, 0};              // of that, towards where the ray came from
        bool ends = false;                  // it went to a light
    };
    // Of the root of a steradian: what a direction stands for beside all others that are sampled from its
    // hit.
    static constexpr float Share = 1.0f / 8;
    static constexpr float Glass = 1.5f; // what solids refract like

    // Half of the paths, others at each bounce and progression.
    static Mask<W> select_half(const SurfaceStage<W>& stage, const SurfaceHit<W>& hit, Mask<W> active) {
        const int turn = stage.at().number + int(stage.at().reversed_progression >> 31);
        return active & (((hit.path + Int<W>(turn)) & Int<W>(1)) != Int<W>(0));
    }

    void arrive(const SurfaceStage<W>& stage, const SurfaceHit<W>& hit, FootprintLog* log, Mask<W>& active) {
        Float<W> curvature(0.0f);
        if (hit.code.leaves > 0)
            curvature = curvature_at(hit);
        const HitState& hits = stage.at().hits;
        for (uint32_t bits = active.bits(); bits; bits &= bits - 1) {
            const int i = __builtin_ctz(bits);
            Cone& cone = m_paths[size_t(hit.path[i])];
            const Vec3f d(hit.d.x[i], hit.d.y[i], hit.d.z[i]), n(hit.N.x[i], hit.N.y[i], hit.N.z[i]);
            if (stage.at().number > 0) {
                const float mis = hit.ray[PathQueue::Mis][i]; // over the density, but for smooth lobes
                const float smooth = dot(d, cone.normal) > 0 ? cone.reflected : cone.refracted;
                const float rough = Share * std::sqrt(std::max(mis, 0.0f) / float(Wavelengths));
                // A light's spread is its own; a lobe adds to what came in.
                cone.spread = cone.ends || rough > std::abs(smooth) ? rough : smooth;
            }
            cone.width += cone.spread * hit.t[i];
            if (log)
                tell(*log, hits, hit, i, std::abs(cone.width));
            // The facets' normals turn by so much over the ray's width, as it comes in.
            const float turn = curvature[i] * cone.width, index = hit.outside[i] ? 1 / Glass : Glass;
            cone.reflected = cone.spread + 2 * turn;
            cone.refracted = index * cone.spread + (index - 1) * turn;
            cone.normal = n;
            if (cone.ends)
                active.v[i] = 0;
        }
    }

    void tell(FootprintLog& log, const HitState& hits, const SurfaceHit<W>& hit, int i, float width) const {
        const size_t slot = size_t(hit.slot[i]);
        float rows[12];
        const bool instanced = hits.instanced[slot] != 0;
        for (size_t k = 0; instanced && k < 12; k++)
            rows[k] = hits.world_from_shape[k][slot];
        log.note({hit.shape.object_id[i],
                  {hit.P.x[i], hit.P.y[i], hit.P.z[i]},
                  instanced ? rows : nullptr,
                  width});
    }

    // Of the sides of the hit's triangle, by the normals at its corners, the largest; positive where the
    // surface bulges towards the ray. In units of the shape: of what is instanced at another size it is off
    // by that.
    static Float<W> curvature_at(const SurfaceHit<W>& hit) {
        using F = Float<W>;
        using R = store::ShapeRecord;
        const Mask<W> curved = hit.shape.has(R::HasNormals) & !hit.shape.has(R::Fibre);
        F most(0.0f);
        if (!any(curved))
            return most;
        const Corners<W> corners(hit.shape, hit.place, hit.hit[HitState::U], hit.hit[HitState::V]);
        Vec3<F> p[3], n[3];
        for (int k = 0; k < 3; k++) {
            const Int<W> traced = select(curved, corners.traced[k], Int<W>(0));
            p[k] =
                vector_of(load_rows<4>(hit.code.page_floats(), hit.shape.positions + traced * Int<W>(3)), 0);
            n[k] = hit.fetch.normal_of(corners.vertex[k], curved);
        }
        for (int k = 0; k < 3; k++) {
            const Vec3<F> along = p[(k + 1) % 3] - p[k], turned = n[(k + 1) % 3] - n[k];
            const F bend = dot(turned, along) / max(dot(along, along), F(1e-30f));
            most = select(abs(bend) > abs(most), bend, most);
        }
        return select(curved, select(hit.outside, most, -most), F(0.0f));
    }

    // Those of `asked` that have a light to go to.
    Mask<W> go_to_light(SurfaceStage<W>& stage, const Scattering<W>& s, Mask<W> asked) {
        const Bounce& at = stage.at();
        if (at.scene.lights.choices == 0 || !any(asked))
            return Mask<W>(false);
        const LightNumbers<W> u(at.scene, s.sampler, at.number);
        const LightSample<W> light = sample_light(at.scene, s.chooser, s.receiver, 0, u, s.h.l, asked);
        const Float<W> above = dot(light.wi, s.h.horizon);
        const Mask<W> m = asked & light.valid & s.reaches(s.h.to_local(light.wi), above);
        // Of delta lights the spread of the ray is the receiver's alone.
        const Float<W> inverse = Float<W>(1.0f) / max(light.pdf_solid_angle, Float<W>(1e-12f));
        const Float<W> mis = select(light.delta, Float<W>(1e-12f), inverse * Float<W>(float(Wavelengths)));
        stage.leave(s, light.wi, above < Float<W>(0.0f), s.h.throughput, bsdf::Spectrum<W>(Float<W>(1.0f)),
                    mis, m);
        for (uint32_t bits = m.bits(); bits; bits &= bits - 1)
            m_paths[size_t(s.h.path[__builtin_ctz(bits)])].ends = true;
        return m;
    }

    int m_bounces;
    std::vector<Cone> m_paths;
};

} // namespace kanuka::transport::footprints
