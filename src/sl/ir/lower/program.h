// A shader as a whole: which stages it has, what runs in each and what each hands out.
#pragma once

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class ProgramLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void run();

  private:
    void begin_stage(Stage& stage, Role role, const char* name);
    void end_stage();
    void class_stages();
    void class_stage(const char* method, Stage& stage, Role role);
    void class_outputs(Stage& stage, Role role, bool lit);
    void classic_stage();
    void light_stage();
    void filter_stage();
    void take_result();
    void normal_output();
    void aov_outputs();
    void unset_color();
    ast::FunctionDecl* method(std::string_view name);
    ast::FunctionDecl* stage_method(std::string_view name);
    std::vector<ast::FunctionDecl*> lit_methods();
};

} // namespace kanuka::sl::ir
