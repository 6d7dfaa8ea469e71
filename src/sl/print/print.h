// What the compiler makes of a shader, written for people: kanuka shader compile --emit.
#pragma once

#include <string>

#include "sl/ir/plan.h"
#include "sl/parse/ast.h"
#include "sl/parse/source.h"

namespace kanuka::sl {

// The checked tree: a node a line, its type behind it.
std::string print_tree(const ast::ShaderDecl& shader, const Sources& sources);
// A stage as the code generator gets it: masks in place of varying control flow, cut into regions.
std::string print_ir(const ir::Program& program, const ir::Stage& stage, const ir::Plan& plan,
                     const Sources& sources);
// A stage as C would say it: control flow as written, one expression where a value is used once.
std::string print_c(const ir::Program& program, const ir::Stage& stage, const Sources& sources);

// "matte.sl:12: the line", or nothing for code that has no line of its own.
std::string source_line(const Sources& sources, Loc at);
std::string_view call_name(ir::CallKind kind);
std::string output_name(const ir::Program& program,
                        const ir::Output& output); // "result.P", or of its channel
std::string parameter_name(const ir::Program& program,
                           const ir::Instr& instr);                // with the element that it reads
std::string channel_name(const ir::Program& program, int channel); // "coat.weight", "presence"

} // namespace kanuka::sl
