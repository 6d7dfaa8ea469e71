// What the parts of one lowering share: the program that is made, what the stage that is being lowered has
// come to, and each other.
#pragma once

#include <unordered_map>

#include "sl/ir/builder.h"
#include "sl/ir/lower.h"

namespace kanuka::sl::ir {

enum class Role { Defaults, Init, Interior, Displace, Shade, Light, Filter };

// What a declared variable stands for in the IR.
struct Binding {
    enum Kind : uint8_t { None, Value, Variable, Lobe, Handle } kind = None;
    Ref value = ir::None;    // Value
    int var = -1;            // Variable; arrays too
    int length = -1;         // of a resizable array: the variable of its length
    std::vector<int> inputs; // Lobe: a variable for each input of the lobe
    std::vector<bool> given; // Lobe: inputs that some constructor named
};

// What a value is to a lobe, so that illuminance loops and fresnel() can be read (directions.h).
enum class Tag : uint8_t {
    None,
    View,       // I
    Eye,        // -I
    Facing,     // a normal that faceforward() turned: unturned, since surfaces have two sides
    Behind,     // such a normal the other way round
    Negated,    // any other normal the other way round
    ViewCosine, // I . N
    EyeCosine,  // -I . N
    Mirrored,
    Refracted,
    Light,
    Half,
    LightMirrored,
    Cosine,
    HalfCosine,
    MirrorCosine,
    Ward // a kernel already, times what is known
};

struct LoopTargets {
    int leave, next;
};

// The loops around what is being lowered.
struct LoopState {
    std::vector<LoopTargets> targets; // of the function that is being lowered
    int depth = 0;                    // callers' loops counted
    int trips = 1;                    // how often they run it at most, 0 = that is not seen
    int known = 0;                    // loops that trips counts
};

// The loop over light around what is being lowered.
struct LightState {
    int depth = 0;         // of illuminance loops that are read as lobes
    int number = -1;       // of the innermost of those
    Ref sample = ir::None; // direction to a light, in a loop that runs over directions
};

// A function that is being inlined, and the co-shader whose it is; -1 = the shader's own.
struct ActiveFunction {
    const ast::FunctionDecl* function;
    int unit;
};

// Where its return statements lead; -1 = they need no jump.
struct ReturnTarget {
    int target, var;
};

// Of one stage; each begins with a new one.
struct StageState {
    Role role = Role::Defaults;
    bool lit = false;          // its Ci is read as a material
    Block* prologue = nullptr; // where globals get their values: before all else
    std::vector<Item> starts;  // what co-shaders do before the stage begins
    std::unordered_map<const ast::VarDecl*, Binding> bindings;
    std::unordered_map<Ref, Tag> tags;
    std::unordered_map<int, Tag> var_tags;
    std::vector<ActiveFunction> active;
    std::vector<ReturnTarget> returns;
    int self = -1; // the co-shader whose code is being lowered
    LoopState loops;
    LightState light;
};

class ArrayLowerer;
class AssignmentLowerer;
class CoshaderLowerer;
class DirectionLowerer;
class EmissionLowerer;
class ExpressionLowerer;
class FunctionLowerer;
class HandleTracker;
class LightLoopLowerer;
class MaterialLowerer;
class MemberLowerer;
class OpticsLowerer;
class ParameterLowerer;
class QueryLowerer;
class ShadeopLowerer;
class SplineLowerer;
class StatementLowerer;
class TextureLowerer;
class VariableLowerer;
class WardLowerer;

struct LowerContext {
    Program& program;
    Sema& sema;
    Diagnostics& diagnostics;
    ast::ShaderDecl& shader;
    const LowerOptions& options;
    const Linked* linked; // null = no co-shaders are known
    Builder builder;
    StageState stage;
    bool overflow = false; // the program grew too large: nothing more is lowered

    // The parts; lower.cpp makes them.
    ParameterLowerer* parameters = nullptr;
    MemberLowerer* members = nullptr;
    VariableLowerer* variables = nullptr;
    AssignmentLowerer* assignments = nullptr;
    ExpressionLowerer* expressions = nullptr;
    StatementLowerer* statements = nullptr;
    FunctionLowerer* functions = nullptr;
    ShadeopLowerer* shadeops = nullptr;
    TextureLowerer* textures = nullptr;
    QueryLowerer* queries = nullptr;
    ArrayLowerer* arrays = nullptr;
    SplineLowerer* splines = nullptr;
    MaterialLowerer* materials = nullptr;
    DirectionLowerer* directions = nullptr;
    OpticsLowerer* optics = nullptr;
    WardLowerer* ward = nullptr;
    LightLoopLowerer* light_loops = nullptr;
    HandleTracker* tracker = nullptr;
    CoshaderLowerer* coshaders = nullptr;
    EmissionLowerer* emission = nullptr;
};

Ty ty(const ast::Type& t);
bool has_return(const ast::Stmt* s); // anywhere in it

} // namespace kanuka::sl::ir
