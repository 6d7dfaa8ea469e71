// Parameters: their places, their default values, and what stands for them in a stage.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class ParameterLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void declare(); // the shader's and its co-shaders'
    // Constants go into the description; the rest is computed by a stage when an instance is made.
    void default_values();
    Binding bind(const ast::VarDecl* v);
    int index(const ast::VarDecl* v) { return m_index[v]; }

  private:
    void add(const ast::VarDecl* v, std::string name);
    void default_value(const ast::VarDecl* v, int index);
    std::vector<Ref> given_values(const ast::VarDecl* v, const ast::Type& element, int size);
    static bool late_default(const ast::VarDecl* v);
    Binding bind_late(const ast::VarDecl* v, int index);
    Binding bind_array(const ast::VarDecl* v, int index, const std::vector<std::string>* known);

    std::vector<const ast::VarDecl*> m_parameters; // in the order of the program's
    std::unordered_map<const ast::VarDecl*, int> m_index;
};

} // namespace kanuka::sl::ir
