// Members of a class, and how they and its output parameters travel from stage to stage.
//
// RSL 2.0 runs begin(), displacement() and surface() once each, one after the other, on one set of members.
// Here displacement and surface are stages of their own, and begin() runs in both, for what it does besides;
// what displacement leaves in a member or an output parameter travels on the grid, one value a vertex, under
// a name that no source can say. Arrays, strings and members declared uniform do not travel.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class MemberLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void declare();
    // What a co-shader's member is when a stage begins; None = as it is declared.
    Ref initial_value(const ast::VarDecl* v);
    void keep(Stage& init); // what mnk_init leaves
    void leave();           // what displacement leaves
    void take();            // at the beginning of the surface
    void drop_unread();     // at its end: what it does not read is not kept

  private:
    void leave(const ast::VarDecl* v);

    std::unordered_map<const ast::VarDecl*, int> m_index;
    std::vector<std::pair<const ast::VarDecl*, int>> m_carried; // with the parameters that carry them
};

} // namespace kanuka::sl::ir
