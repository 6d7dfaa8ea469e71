// Directions to light and eye, and the cosines between them, as lobes see them. Values are tagged with what
// they are: the view direction, a direction to a light, half between them, mirrored. A cosine that is the
// kernel of a lobe becomes a factor for closures.cpp, which multiplies it with Cl to a whole term:
//
//   illuminance (P, N, PI/2) C += Cl * (N . normalize(L));              is diffuse(N)
//   … Cl * pow(max(0, N . H), 1 / roughness), H = normalize(Ln + V);    is specular(N, V, roughness)
//   … Cl * smoothstep(a, b, pow(…));                                    is as wide at half its height
//   … Cl * (N . Ln) * exp(-2 ((X . H)^2 + (Y . H)^2) / (1 + H . N)) …   is Ward's: ward.h
//   … Cl * pow(max(0, R . Ln), size), R = reflect(I, N);                is phong(N, V, size)
#pragma once

#include <set>

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class DirectionLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    static bool is_view(Tag t) { return t == Tag::View || t == Tag::Eye; }
    static bool to_light(Tag t) { return t == Tag::Light || t == Tag::Half || t == Tag::LightMirrored; }

    Ref view(Loc at);
    Ref to_light(Tag t, Loc at);
    // A factor of the loop that is being read.
    Ref kernel(Closure kind, Ty ty, std::vector<Ref> args, Tag t, Loc at);
    // A normal as faceforward() means it: towards the eye; one behind away from it. Lobes take it as it is,
    // for they have two sides.
    Ref turned(Ref normal, Loc at);
    Ref negated(Ref value, bool normal, Loc at);
    Ref arithmetic(ast::BinOp op, Ref a, Ref b, Loc at); // None = nothing special

  private:
    static Tag side_less(Tag t) { return t == Tag::Negated ? Tag::None : t; }
    Ref scaled(ast::BinOp op, Ref a, Ref b, Loc at);
    Ref dot(Ref a, Ref b, Loc at);
    Ref side_of_light(bool less, Ref a, Ref b);
    bool depends_on_view(Ref r, std::set<Ref>& seen);
};

} // namespace kanuka::sl::ir
