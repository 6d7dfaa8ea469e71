// docs/lobes.md, and the parts of docs/language.md that are made from the tables, in Markdown.
#pragma once

#include <string>

namespace kanuka::sl::ops {

std::string lobes_manual();   // every lobe with its inputs
std::string lobes_page();     // docs/lobes.md
std::string globals_manual(); // the variables that every shader sees
std::string shadeops_index(); // a line each; docs/shadeops.md has the signatures

} // namespace kanuka::sl::ops
