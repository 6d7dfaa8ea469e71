// Ward's anisotropic highlight (Measuring and Modeling Anisotropic Reflection, 1992), as the illuminance
// loops of published shaders have it (eq. 5, in his form for half vectors):
//
//   rho = exp(-2 ((X . H)^2 + (Y . H)^2) / (1 + H . N)) / sqrt((N . L) (N . V));
//   C += Cl * (N . L) * rho;
//
// X and Y are tangents, divided by the widths of the highlight. It is a microfacet lobe of these widths; the
// cosines and their root, which do nothing on its axis, are the lobe's own matter.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class WardLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref kernel(Ref exponent, Loc at); // exp(exponent); None = it is none
    // What it is multiplied with and divided by; None = nothing special.
    Ref arithmetic(ast::BinOp op, Ref a, Ref b, Loc at);

  private:
    struct Exponent {
        float factor = 0;
        Ref normal = ir::None, X = ir::None, Y = ir::None;
    };
    Exponent read(Ref exponent) const;
    bool of_light(Ref r, int depth = 0) const;
    Ref without_cosine(Ref r, Loc at);
    Ref squared_half(Ref r) const;
};

} // namespace kanuka::sl::ir
