// The terms that a classic surface's light is made of: shared by closures_sites.cpp, which finds them,
// closures_rewrite.cpp, which computes with them, and lobes.cpp, which makes lobes of them.
#pragma once

#include <map>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

struct Site {
    Closure kind;
    Loc loc;
    int shape = -1;      // variable: the exponent that shapes a highlight
    int eta = -1;        // variable: of a Fresnel factor
    int anisotropy = -1; // variables: of a highlight that is not round
    int rotation = -1;
    int aim = -1;                // variable: where the light comes from
    int first = -1, second = -1; // a product of two factors: their sites
    int loop = -1;               // number of the illuminance loop that a factor belongs to
    // Variable: what this is worth where a value is wanted: fresnel()'s as seen from the dicing camera, the
    // weight of one direction of a projected loop. -1 = one: a white surface, fully lit.
    int reference = -1;
};

// How much narrower than across its grooves a lobe of anisotropy 1 is along them: 1 - this
// (bsdf/microfacet.h).
inline constexpr float Stretch = 0.95f;

inline bool is_factor(Closure k) {
    return k >= Closure::Light && k <= Closure::FresnelTransmit;
}
inline bool has_shape(Closure k) {
    return k == Closure::Specular || k == Closure::Phong || k == Closure::SpecularKernel ||
           k == Closure::PhongKernel;
}
inline bool is_fresnel(Closure k) {
    return k == Closure::FresnelReflect || k == Closure::FresnelTransmit;
}
// What an illuminance loop that is read as a lobe is made of.
inline bool in_loop(Closure k) {
    return (is_factor(k) && !is_fresnel(k)) || k == Closure::LightDirection;
}
// A whole term: light, through a lobe.
inline bool is_light(Closure k) {
    return !is_fresnel(k) && !in_loop(k);
}
inline bool is_lambert(Closure k) {
    return k == Closure::Diffuse || k == Closure::LightSample;
}

// The term that two factors make; LightDirection = none.
inline Closure product_kind(Closure a, Closure b) {
    if (b == Closure::Light || is_fresnel(a))
        std::swap(a, b);
    if (a == Closure::Light)
        switch (b) {
        case Closure::CosineKernel:
            return Closure::Diffuse;
        case Closure::CosineBehind:
            return Closure::DiffuseBehind;
        case Closure::SpecularKernel:
            return Closure::Specular;
        case Closure::PhongKernel:
            return Closure::Phong;
        default:
            return Closure::LightDirection;
        }
    if (b == Closure::FresnelReflect)
        switch (a) {
        case Closure::Mirror:
        case Closure::Environment:
            return Closure::DielectricMirror;
        case Closure::Specular:
        case Closure::Phong:
            return Closure::DielectricGlossy;
        default:
            return Closure::LightDirection;
        }
    if (b == Closure::FresnelTransmit && a == Closure::Refraction)
        return Closure::DielectricTransmit;
    return Closure::LightDirection;
}

// What Ci holds at the end: a variable with the weight of each term.
struct LightTerms {
    std::vector<Site> sites;
    std::map<int, int> weights; // by site: variable
    bool plain = false;         // Ci itself may hold something else than zero
};

// Ends the shade stage: channels and lobes out of terms.
void write_lobes(Program& program, Builder& builder, const LightTerms& terms);

} // namespace kanuka::sl::ir
