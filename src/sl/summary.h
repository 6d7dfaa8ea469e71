// What a shader from the cache needs besides its code, so that neither parsing nor lowering runs: the
// description of the shader, and of each stage as much as the host reads while it runs (call sites, outputs,
// the size of the frame).
//
// A Program read back is hollow: its stages have outputs and are there or not, but have no instructions. It
// runs, and compiles nothing; the source is read again where another variant is asked for.
#pragma once

#include <string>
#include <string_view>

#include "sl/shader.h"

namespace kanuka::sl {

struct Summary {
    ir::Program program;                  // only of the first variant, which runs mnk_init
    std::vector<Journal::Entry> messages; // that compiling gave; likewise
    Build build;                          // without code
    // Outputs of the shade stage that are uniform, for grids without and with primvars Cs (1) and Os (2).
    std::vector<bool> uniform[4];
};

// Of what entries hold, besides the compiler's version.
inline constexpr int SummaryVersion = 8;
// A Program that grows a member must be kept whole: look through summary.cpp, then change both numbers.
inline constexpr size_t ProgramSize = 2080;

// The summary, then the object. `uniform` as in Summary.
std::string pack_entry(const ir::Program& program, const std::vector<Journal::Entry>& messages,
                       const Build& build, const std::vector<bool> (&uniform)[4], bool first,
                       const std::string& name, std::string_view object);
// False if the entry makes no sense. `name`, if there is one, stands for the shader's file, wherever the
// entry was made.
bool unpack_entry(std::string_view entry, bool first, const std::string& name, Summary& summary,
                  std::string_view& object);

} // namespace kanuka::sl
