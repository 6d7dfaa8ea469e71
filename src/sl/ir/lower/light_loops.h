// Loops over light and rays.
//
// An illuminance loop is read in one of two ways. Once, with L and Cl as symbols (directions.h): then its
// kernel is that of a lobe, and exact. Where closures.cpp finds that it is none, the loop is lowered again,
// projected: its body runs for a fixed set of directions, evenly spread over the loop's cone, and what the
// directions add up to is the albedo of the kernel f, a = 1/pi integral of f over the cone, which becomes a
// Lambert lobe's. (In RISpec a light of colour Cl makes a surface of f = N . L show Cl, so a = 1 there.)
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class LightLoopLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void illuminance(const ast::Stmt* s);
    void gather(const ast::Stmt* s);
    // A variable that says what a closure is where its value is wanted before light is known; 0 until then.
    int reference_value(const char* name, Loc at);

  private:
    struct Cone {
        Ref axis = ir::None, angle = ir::None;
    };
    static size_t first_argument(const ast::Stmt* s);
    Cone cone_of(const ast::Stmt* s);
    void read(const ast::Stmt* s, int number);
    void project(const ast::Stmt* s, Loc reason);
    void ask_lights(const ast::Stmt* s);
    Ref lit_cone(const Cone& cone, Ref L, Ref Cl, Loc at);
    Binding bind_color(Loc at);
    void set_direction(Ref L, Loc at);
    bool seen_by_rays(const ast::Stmt* s, const std::vector<Ref>& values);

    int m_seen = 0; // illuminance loops so far, in all stages
};

} // namespace kanuka::sl::ir
