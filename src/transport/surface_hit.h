// A hit on a surface, one a lane: where it is, which way it faces, and the inputs of its material.
#pragma once

#include <optional>

#include "transport/fetch.h"
#include "transport/media.h"
#include "transport/path_state.h"
#include "transport/scene_view.h"

namespace kanuka::transport {

// What is known wherever a batch of paths has come to.
struct Bounce {
    const SceneView& scene;
    BatchState& batch;
    const PathQueue& paths;
    const HitState& hits;
    int number;                    // 0 = camera rays
    uint32_t reversed_progression; // for samplers
};

template <int W>
struct SurfaceHit {
    using F = Float<W>;
    using I = Int<W>;
    using V = Vec3<F>;
    using M = Mask<W>;
    using S = Spectrum<W>;

    const bsdf::MaterialCode& code;
    I slot;
    Row<W, PathQueue::Fields> ray; // as it came here
    Row<W, HitState::Fields> hit;
    I path;
    F l[Wavelengths];
    S throughput;
    V d, P, Ng, N; // Ng and N: unit, on the side of the viewer; N may lean from Ng
    V horizon;     // of what lies above the surface: Ng, or N where facets stand for a curved surface
    V T, B;
    M outside; // the viewer is on the outside
    F cos_o, t;
    F clearance; // between the surface and rays that start here
    F raw_cos_outside;
    ShapeLanes<W> shape;
    HitPlace<W> place;
    std::optional<InstanceLook<W>> look; // where instances differ
    InputFetch<W> fetch;
    M camera;             // nobody sees what it has passed: see camera_paths()
    Crossing<W> crossing; // where scene.media.tracked

    SurfaceHit(const SurfaceHit&) = delete; // `fetch` refers to its fields
    SurfaceHit(const Bounce& at, const bsdf::MaterialCode& code, I slot)
        : code(code), slot(slot), ray(load_rows<PathQueue::Fields>(at.paths.row, slot << 4)),
          hit(load_rows<HitState::Fields>(at.hits.row, slot << 3)), path(bitcast_int(ray[PathQueue::Path])),
          throughput(spectrum_of(ray, PathQueue::Throughput)), d(vector_of(ray, PathQueue::Direction)),
          Ng(vector_of(hit, HitState::Ng)), t(hit[HitState::T]),
          shape(at.scene.geometry.shapes, bitcast_int(hit[HitState::Shape])),
          place(code.page_words, shape, bitcast_int(hit[HitState::Prim]), hit[HitState::U], hit[HitState::V]),
          look(look_of(at, slot)), fetch(at.scene, code, shape, place, l, look ? &*look : nullptr),
          camera(camera_paths(at.scene, at.paths, slot, at.number)) {
        const auto waves = load_rows<4>(at.batch.l, path << 2);
        for (size_t k = 0; k < Wavelengths; k++)
            l[k] = waves[k];
        V anchor = traced_vertex(shape.positions, place.anchor);
        V e1 = traced_vertex(shape.positions, place.other[0]) - anchor,
          e2 = traced_vertex(shape.positions, place.other[1]) - anchor;
        F magnitude(0.0f);
        if (at.scene.geometry.moving)
            follow_motion(at, anchor, e1, e2, magnitude);
        else
            N = fetch.normal(shape);
        const M fibre = shape.has(store::ShapeRecord::Fibre);
        if (any(fibre))
            stand_on_fibre(at, fibre, anchor, e1, e2, magnitude);
        F extent = largest(e1, e2);
        const F slender = select(fibre, F(1.0f), turn_to_triangle(e1, e2, extent));
        if (at.scene.geometry.instanced)
            leave_instance(at.hits, anchor, e1, e2, extent, magnitude);
        // Cast the hit onto the plane of its triangle: the ray parameter loses digits far from the
        // origin.
        P = vector_of(ray, PathQueue::Origin) + d * t;
        P += Ng * dot(anchor - P, Ng);
        stand_clear(magnitude, extent, slender);
        orient();
        horizon = Ng;
        if (!code.transmits && any(shape.has(store::ShapeRecord::Rounded)))
            rise(at);
        if (code.has_tangent)
            along_tangent(tangent(at, fibre & !shape.has(store::ShapeRecord::Balls), e1));
        else
            coordinate_frame(N, T, B);
        if (at.scene.media.tracked)
            crossing = {at.scene, MediaStack<W>::load(at.paths, bitcast_int(ray[PathQueue::Interior]), slot),
                        shape.interior, outside};
    }

    V to_local(const V& w) const { return {dot(w, T), dot(w, B), dot(w, N)}; }
    V to_world(const V& w) const { return T * w.x + B * w.y + N * w.z; }
    // Where the light of a lobe of one direction comes from, in the frame of the hit.
    V aim(const Bounce& at, Int<W> leaf) const {
        constexpr auto Id = bsdf::LobeId::AimedBsdf;
        V world = N;
        for (const bsdf::MaterialCode::Node& n : code.nodes)
            if (n.leaf >= 0 && code.aimed >> n.leaf & 1) {
                const V w(fetch.exact(n.inputs[grid::input_of(Id, "x")]),
                          fetch.exact(n.inputs[grid::input_of(Id, "y")]),
                          fetch.exact(n.inputs[grid::input_of(Id, "z")]));
                const V d = unit(at.scene.geometry.instanced ? placed(at.hits, w) : w);
                world = select(leaf == I(n.leaf), d, world);
            }
        return to_local(world);
    }
    // Of the lobes that have their own, by leaf, in the frame of the hit.
    void lobe_normals(const Bounce& at, V (&normals)[bsdf::MaxLobes]) const {
        for (const bsdf::MaterialCode::Node& n : code.nodes)
            if (n.leaf >= 0 && code.turned >> n.leaf & 1) {
                const V own = fetch.direction(*bsdf::MaterialCode::normal_of(n));
                normals[n.leaf] = to_local(at.scene.geometry.instanced ? placed_normal(at.hits, own) : own);
            }
    }
    // A start for rays on the side of w, clear of the surface.
    V offset(const V& w) const { return P + Ng * copysign(clearance, dot(w, horizon)); }

  private:
    static std::optional<InstanceLook<W>> look_of(const Bounce& at, I slot) {
        const VariationRow* rows = at.scene.geometry.variations;
        return rows ? std::optional<InstanceLook<W>>(std::in_place, rows,
                                                     gather(at.hits.variation.data(), slot))
                    : std::nullopt;
    }
    // Anchors a hit on a fibre where its surface has the hit's normal, at the end of the segment that is
    // farther that way: a plane of that normal touches the surface there, along the segment, and at the hit.
    // Its sides are both the segment.
    void stand_on_fibre(const Bounce& at, M fibre, V& anchor, V& e1, V& e2, F& magnitude) const {
        const MotionLanes<W> motion(at.scene.geometry.shapes, bitcast_int(hit[HitState::Shape]),
                                    at.scene.geometry.moving ? gather(at.batch.time, path) : F(0.0f));
        const M moves = fibre & motion.moving;
        const I still = shape.positions + place.anchor * I(4);
        const I first = select(fibre, still + select(moves, motion.segment * motion.stride, I(0)), I(0)),
                next = first + select(moves, motion.stride, I(0));
        const F f = select(moves, motion.f, F(0.0f));
        V p[2];
        F radius[2], size(0.0f);
        const I to_end = select(shape.has(store::ShapeRecord::Balls), I(0), I(4));
        for (int k = 0; k < 2; k++) {
            const I row = k == 0 ? I(0) : to_end;
            const auto a = load_rows<4>(code.page_floats(), first + row),
                       b = load_rows<4>(code.page_floats(), next + row);
            for (size_t c = 0; c < 3; c++)
                p[k][int(c)] = a[c] + (b[c] - a[c]) * f;
            radius[k] = a[3] + (b[3] - a[3]) * f;
            size = max(size, largest(vector_of(a, 0), vector_of(b, 0)));
        }
        const V axis = p[1] - p[0], n = unit(Ng);
        const M second = dot(n, axis) + (radius[1] - radius[0]) > F(0.0f);
        anchor = select(fibre, select(second, p[1] + n * radius[1], p[0] + n * radius[0]), anchor);
        e1 = select(fibre, axis, e1), e2 = select(fibre, axis, e2);
        magnitude = select(fibre, select(moves, size, F(0.0f)), magnitude);
    }
    // dPdu; around a fibre.
    V tangent(const Bounce& at, M fibre, const V& axis) const {
        const V t = leave_instance(at, fetch.tangent());
        return any(fibre) ? select(fibre, cross(select(outside, N, -N), leave_instance(at, axis)), t) : t;
    }

    // How far the tracer may see the surface from P: a few units in the last place of what it computes with
    // (Waechter and Binder 2019, A Fast and Robust Method for Avoiding Self-Intersection; bounds as in Pharr,
    // Jakob and Humphreys 2023, section 6.8.) That are coordinates of the place, also on the way through
    // instances, and differences between a ray's start and corners of the triangle; of slender triangles
    // the normal that those differences span is less sure.
    void stand_clear(F magnitude, F extent, F slender) {
        clearance = fma(largest(P, P) + magnitude, F(1.5e-6f),
                        fma(extent, fma(slender, F(5e-7f), F(1e-6f)), F(1e-30f)));
    }

    static F largest(const V& a, const V& b) {
        return max(max(max(abs(a.x), abs(b.x)), max(abs(a.y), abs(b.y))), max(abs(a.z), abs(b.z)));
    }
    static V unit(const V& v) { // of any length that is a number
        const V w = v * (F(1.0f) / max(largest(v, v), F(1e-37f)));
        return w * (F(1.0f) / sqrt(max(dot(w, w), F(1e-37f))));
    }
    // Ng of the triangle with these sides, towards where the tracer has it. The tracer's own is spanned by
    // differences to the ray's start: of a small triangle far away few of its digits hold. Returns one over
    // the normal's length, in units of the longest sides.
    F turn_to_triangle(const V& e1, const V& e2, F extent) {
        const F inverse = F(1.0f) / max(extent, F(1e-37f));
        const V n = cross(e1 * inverse, e2 * inverse);
        const F n2 = dot(n, n), least(1e-10f), slender = F(1.0f) / sqrt(max(n2, least));
        const V traced = unit(Ng), mine = n * slender;
        Ng = select(n2 > least, mine * copysign(F(1.0f), dot(mine, traced)), traced);
        return slender;
    }

    void follow_motion(const Bounce& at, V& anchor, V& e1, V& e2, F& magnitude) {
        const MotionLanes<W> motion(at.scene.geometry.shapes, bitcast_int(hit[HitState::Shape]),
                                    gather(at.batch.time, path));
        if (!any(motion.moving)) {
            N = fetch.normal(shape);
            return;
        }
        const I first = shape.positions + motion.segment * motion.stride;
        const I still = select(motion.moving, first, shape.positions),
                later = select(motion.moving, first + motion.stride, shape.positions);
        V corner[3];
        for (int k = 0; k < 3; k++) {
            const I vertex = k == 0 ? place.anchor : place.other[k - 1];
            const V a = traced_vertex(still, vertex), b = traced_vertex(later, vertex);
            corner[k] = select(motion.moving, a + (b - a) * motion.f, a);
            magnitude = max(magnitude, select(motion.moving, largest(a, b), F(0.0f)));
        }
        anchor = corner[0];
        e1 = corner[1] - anchor, e2 = corner[2] - anchor;
        N = fetch.normal(shape, motion);
    }

    // The outside is where the shading normals point; where there are none, where the winding says.
    void orient() {
        using R = store::ShapeRecord;
        const M has_normal = shape.has(R::HasNormals);
        const V winding = select(shape.has(R::Flips), -Ng, Ng);
        V out = select(has_normal & (dot(Ng, N) < F(0.0f)), -Ng, select(has_normal, Ng, winding));
        N = select(has_normal, N, out);
        N = N * (F(1.0f) / sqrt(max(dot(N, N), F(1e-37f))));
        const F c = -dot(d, out);
        outside = c > F(0.0f);
        raw_cos_outside = c;
        Ng = select(outside, out, -out);
        N = select(outside, N, -N);
        // A shading normal that faces away from the viewer is bent back to the horizon.
        const F facing = -dot(d, N);
        const F low(0.01f);
        const V bent = N + (-d) * (low - facing);
        N = select(facing < low, bent * (F(1.0f) / sqrt(dot(bent, bent))), N);
        cos_o = max(-dot(d, N), F(1e-4f));
    }
    // Onto the surface that facets stand for, where it bulges: above the facet by as much as the planes
    // through its corners, across their normals, are on average (Hanika 2021, Hacking the Shadow Terminator,
    // in Ray Tracing Gems II). From there the facet hides nothing above the shading normal's horizon.
    [[gnu::noinline]] void rise(const Bounce& at) {
        const M round = shape.has(store::ShapeRecord::Rounded);
        const Corners<W> corners(shape, place, hit[HitState::U], hit[HitState::V]);
        const F zero(0.0f);
        V corner[3], middle(zero, zero, zero), up(zero, zero, zero);
        for (int k = 0; k < 3; k++) {
            corner[k] = traced_vertex(shape.positions, select(round, corners.traced[k], I(0)));
            middle += corner[k] * corners.weight[k];
        }
        for (int k = 0; k < 3; k++) {
            const V outward = fetch.normal_of(corners.vertex[k], round),
                    n = select(outside, outward, -outward);
            up -= n * (min(dot(middle - corner[k], n), zero) * corners.weight[k]);
        }
        if (at.scene.geometry.instanced)
            up = placed(at.hits, up);
        const M bulges = round & (dot(up, Ng) > clearance);
        P = select(bulges, P + up, P);
        horizon = select(bulges, N, horizon);
    }

    // x along a tangent, as far as the normal lets it.
    void along_tangent(const V& t) {
        const V flat = t - N * dot(t, N);
        const F size = dot(flat, flat);
        coordinate_frame(N, T, B);
        T = select(size > F(1e-12f), flat * (F(1.0f) / sqrt(max(size, F(1e-12f)))), T);
        const V side = cross(N, T); // the same way from outside and inside: turns of T agree
        B = select(outside, side, -side);
    }

    V traced_vertex(I positions, I vertex) const {
        return vector_of(load_rows<4>(code.page_floats(), positions + vertex * I(3)), 0);
    }

    void leave_instance(const HitState& hits, V& anchor, const V& e1, const V& e2, F& extent, F& magnitude) {
        const M inside = gather(hits.instanced, slot) != I(0);
        if (!any(inside))
            return;
        F m[12];
        for (int k = 0; k < 12; k++)
            m[k] = gather(hits.world_from_shape[k].data(), slot);
        const V row0(m[0], m[1], m[2]), row1(m[4], m[5], m[6]), row2(m[8], m[9], m[10]);
        const V world(dot(row0, anchor) + m[3], dot(row1, anchor) + m[7], dot(row2, anchor) + m[11]);
        anchor = select(inside, world, anchor);
        const auto turned = [&](const V& v) { return V(dot(row0, v), dot(row1, v), dot(row2, v)); };
        extent = select(inside, largest(turned(e1), turned(e2)), extent);
        // Of what moves within, `magnitude` is in units of the shape: the longest of three rows bounds what
        // becomes of it.
        const F scale = sqrt(max(max(dot(row0, row0), dot(row1, row1)), dot(row2, row2)));
        magnitude = select(inside, fma(magnitude, scale, gather(hits.magnitude.data(), slot)), magnitude);
        Ng = select(inside, unit(turn_normal(m, Ng)), Ng);
        N = select(inside, unit(turn_normal(m, N)), N);
    }

    V leave_instance(const Bounce& at, const V& t) const {
        return at.scene.geometry.instanced ? unit(placed(at.hits, t)) : t;
    }
    // Vectors go with the transform itself.
    V placed(const HitState& hits, const V& v) const {
        const M inside = gather(hits.instanced, slot) != I(0);
        if (!any(inside))
            return v;
        F m[12];
        for (int k = 0; k < 12; k++)
            m[k] = gather(hits.world_from_shape[k].data(), slot);
        const V world(dot(V(m[0], m[1], m[2]), v), dot(V(m[4], m[5], m[6]), v), dot(V(m[8], m[9], m[10]), v));
        return select(inside, world, v);
    }
    V placed_normal(const HitState& hits, const V& n) const {
        const M inside = gather(hits.instanced, slot) != I(0);
        if (!any(inside))
            return n;
        F m[12];
        for (int k = 0; k < 12; k++)
            m[k] = gather(hits.world_from_shape[k].data(), slot);
        return select(inside, turn_normal(m, n), n);
    }
};

} // namespace kanuka::transport
