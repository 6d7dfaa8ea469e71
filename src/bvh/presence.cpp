#include "bvh/presence.h"

#include <algorithm>
#include <cstring>

#include "base/sampling.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {

bool is_partly_there(const store::Store& store, const store::ShapeRecord& s) {
    const store::Links& links = store.links()[size_t(s.links)];
    return store.programs()[size_t(s.program)].presence >= 0 || links.lets_through != 0 ||
           (links.seen & (store::Links::OneSided | store::Links::Unseen)) != 0 || links.fades() ||
           (s.flags & store::ShapeRecord::Layer) != 0;
}

// Stochastic transparency: a surface of presence p stops a ray with probability p. One decision per ray and
// cell, by hash, so hits and shadows need no special case.
bool is_present(const store::Store& store, int shape, int prim, float u, float v, float t,
                const Beholder& beholder) {
    const store::Links& links = store.links_of(shape);
    if (beholder.level < links.level_from || beholder.level >= links.level_to)
        return false;
    if ((links.seen & store::Links::Unseen) && beholder.camera)
        return false;
    if ((beholder.passes & links.lets_through) != 0)
        return false;
    int t_bits;
    std::memcpy(&t_bits, &t, 4);
    const Int<1> h = hash_bits(
        Int<1>(beholder.seed) ^
        hash_bits(Int<1>(int(uint32_t(shape) * 0x9e3779b1u + uint32_t(prim) + (uint32_t(t_bits) & ~0xffu)))));
    const float presence = store.presence(shape, prim, u, v);
    if (to_unit(h)[0] < presence)
        return true;
    if (beholder.passages && store.shapes()[size_t(shape)].flags & store::ShapeRecord::Tinted) {
        const Rgb left = Rgb(1) - store.opacity(shape, prim, u, v);
        beholder.passages->add(t, left * (1 / std::max(1 - presence, 1e-6f)));
    }
    return false;
}

// Candidates come in any order, and one may come twice. They are kept by distance: products of floats depend
// on their order, and that of candidates on the trees of the hierarchy, of which an edit makes others.
void LetThrough::add(float at, const Rgb& let_through) {
    for (int i = 0; i < count; i++)
        if (t[i] == at)
            return;
    Rgb one = let_through;
    if (count == Most) { // the two that are furthest count as one
        const int last = Most - 1;
        const Rgb furthest(part[0][last], part[1][last], part[2][last]);
        if (at > t[last - 1]) {
            one = furthest * one, at = std::max(at, t[last]);
        } else {
            for (int c = 0; c < 3; c++)
                part[c][last - 1] *= furthest[c];
            t[last - 1] = t[last];
        }
        count--;
    }
    int k = count++;
    for (; k > 0 && t[k - 1] > at; k--) {
        t[k] = t[k - 1];
        for (auto& of_color : part)
            of_color[k] = of_color[k - 1];
    }
    t[k] = at;
    for (int c = 0; c < 3; c++)
        part[c][k] = one[c];
}

Rgb LetThrough::before(float end) const {
    Rgb all(1);
    for (int i = 0; i < count; i++)
        if (t[i] < end)
            all = all * Rgb(part[0][i], part[1][i], part[2][i]);
    return all;
}

void presence_filter(const RTCFilterFunctionNArguments* args) {
    const Geometry& g = *static_cast<const Geometry*>(args->geometryUserPtr);
    const Context& context = *reinterpret_cast<const Context*>(args->context);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        const unsigned prim = RTCHitN_primID(args->hit, args->N, i);
        if (is_back(*g.store, g.shape(prim),
                    {RTCHitN_Ng_x(args->hit, args->N, i), RTCHitN_Ng_y(args->hit, args->N, i),
                     RTCHitN_Ng_z(args->hit, args->N, i)},
                    {RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                     RTCRayN_dir_z(args->ray, args->N, i)}) ||
            !is_present(*g.store, g.shape(prim), int(prim), RTCHitN_u(args->hit, args->N, i),
                        RTCHitN_v(args->hit, args->N, i), RTCRayN_tfar(args->ray, args->N, i),
                        context.beholder(RTCRayN_id(args->ray, args->N, i))))
            args->valid[i] = 0;
    }
}

} // namespace kanuka::bvh
