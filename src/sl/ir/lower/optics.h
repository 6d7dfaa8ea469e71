// Shadeops of directions and cosines, which in surfaces keep what these are to lobes (ops::Optics).
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class OpticsLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    Ref shadeop(const ast::Expr* e); // None = as any other
    // diffuse() of a normal the other way round.
    Ref diffuse(Ref normal, Loc at);
    // The exponent of (N . H) that the roughness of specular() and specularbrdf() stands for.
    Ref blinn_exponent(Ref roughness, Loc at);

  private:
    static const ops::Signature& signature(const ast::Expr* e) {
        return e->shadeop->signatures[size_t(e->signature)];
    }
    std::vector<Ref> arguments(const ast::Expr* e);
    Ref plain_source(const ast::Expr* e, const std::vector<Ref>& args);
    void note_occlusion(Loc at);
    Ref fresnel(const ast::Expr* e);
    Ref normalize(const ast::Expr* e);
    Ref length(const ast::Expr* e);
    Ref face_forward(const ast::Expr* e);
    Ref transform_vector(const ast::Expr* e);
    Ref reflect(const ast::Expr* e, Tag made);
    Ref specular_brdf(const ast::Expr* e);
    Ref exponential(const ast::Expr* e);
    Ref smooth_step(const ast::Expr* e);
    Ref cosine_function(const ast::Expr* e);

    bool m_said_occlusion = false;
};

} // namespace kanuka::sl::ir
