// Passes over a stage's IR, in the order in which they run.
#pragma once

#include <map>

#include "sl/ir/builder.h"

namespace kanuka::sl::ir {

// Which of the inputs that may vary do vary: one object is compiled for each combination that occurs.
struct Variant {
    bool Cs = false, Os = false;
    bool E = false;           // ways through air, which begin anywhere
    std::vector<bool> params; // by parameter; empty = none
    std::string key() const;
    bool varies(int param) const { return size_t(param) < params.size() && params[size_t(param)]; }
};

// Makes of environment(map, R) along a mirrored view direction what it is: the picture where there is one,
// else a mirror (pictures.cpp). strict: a mirror.
void choose_pictures(Stage& stage, bool strict);

// Gives each whole assignment of the shade stage a variable of its own, where that is easy (rename.cpp).
void rename_assignments(Program& program);

// Reads Ci as a material (extraction.h). Classic surfaces only. Returns the illuminance loops that are no
// lobes, by number, and where that shows: then the program is of no use, and lower() is to project them.
// strict: what can only be approximated is an error.
std::map<int, Loc> extract_closures(Program& program, Diagnostics& diagnostics, bool strict);

// Forwards values through variables that are assigned once; removes what no output depends on.
void simplify(Stage& stage);

// Makes numbers of strings that may vary (texts.cpp); the variant is that in which all varies that may.
void number_texts(Stage& stage, const Variant& variant, Diagnostics& diagnostics);

// What the stage reads of the surface, and how many rings of neighbours what it hands out depends on
// (reads.cpp).
grid::Reads find_reads(const Stage& stage);

// Marks what varies over a grid (detail.cpp). With diagnostics, complains about uniform variables that do.
void infer_detail(Stage& stage, const Variant& variant, Diagnostics* diagnostics);

// What depends on where the eye is: a flag for each value and each variable.
struct Directions {
    std::vector<bool> refs, vars;
};
Directions find_directions(const Stage& stage);
// Complains where what leaves the stage depends on the direction it is seen from (direction.cpp). frozen: a
// warning, since the direction is that of the dicing camera.
void check_directions(const Program& program, bool frozen, Diagnostics& diagnostics);

// Replaces varying control flow by masks. After infer_detail.
void make_masks(Stage& stage);

// What decides how a call is made: true if it needs whole arrays or the host (not if its arguments make it
// trivial).
bool grid_level(const Stage& stage, const Instr& instr);
bool has_effect(CallKind kind);

} // namespace kanuka::sl::ir
