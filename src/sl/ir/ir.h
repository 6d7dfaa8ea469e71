// The intermediate representation: typed operations on values in structured control flow.
//
// A value is the result of one instruction (a Ref); variables are read and written by Load and Store.
// Functions are inlined, loops and returns are Loop, Scope and Jump. What a value's detail is (one a grid, or
// one a vertex) is found by detail.cpp; masks.cpp then replaces varying control flow by masks, so that only
// uniform control flow remains.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "grid/layering.h"
#include "sl/parse/source.h"
#include "sl/sl.h"

namespace kanuka::sl::ir {

enum class Ty : uint8_t { Void, Bool, Float, Triple, Matrix, String, Mask };
int comps(Ty ty); // floats (or masks) of a value; strings count as one

using Ref = int32_t;
inline constexpr Ref None = -1;

enum class Op : uint8_t { // is_leaf() knows where the leaves end
    // leaves: may stand anywhere, are not placed in blocks
    Const,   // floats
    Text,    // string
    Input,   // imm: Input
    Param,   // imm: index of a parameter; floats: which element, or two of them: the array's length
    Member,  // imm: index of a member variable: its value when the stage begins
    Channel, // imm: index of a channel: its value before any SetLobe
    // variables; imm: index of the variable
    Load,
    Store,        // value [, mask]
    LoadElement,  // index
    StoreElement, // index, value [, mask]
    // componentwise
    Add,
    Sub,
    Mul,
    Div,
    Neg,
    Min,
    Max,
    Abs,
    Floor,
    Ceil,
    Sqrt,
    Math1, // imm: Fn
    Math2,
    // comparisons and logic
    Lt,
    Le,
    Gt,
    Ge,
    Eq,
    Ne,       // floats to Bool
    SameText, // strings to Bool
    And,
    Or,
    Not,    // Bool or Mask
    Select, // Bool, a, b
    // shapes
    ToFloat, // Bool to 0 or 1
    Splat,   // float to triple
    Make,    // floats to triple or matrix
    Extract, // imm: component
    // geometry
    Dot,
    Cross,
    MatMul, // row vectors: a * b applies a first
    Noise,  // imm: index of a noise kernel; args: floats
    // masks
    AllLanes, // those within the grid
    ToMask,
    ToBool,
    AndNot, // a and not b, masks
    // what needs the whole grid or the host; imm: index of a CallSite
    Call,
    // surface colours that are not known before light is: imm: Closure. floats[0]: for the factors of an
    // illuminance loop its number; for fresnel() and LightSample the variable of its reference value
    Closure,
};

// Scalar names as in <cmath>.
enum class Fn : uint8_t { Sin, Cos, Tan, Asin, Acos, Atan, Exp, Log, Log2, Log10, Exp2, Cbrt, Pow, Atan2 };

enum class Input : uint8_t { P, N, Ng, dPdu, dPdv, u, v, s, t, Cs, Os, E, time, du, dv, Count };
struct InputInfo {
    std::string_view name;
    Ty ty;
    bool varying; // on every grid
    bool primvar; // on grids that carry a primvar of this name
};
const InputInfo& input_info(Input input);

enum class Closure : uint8_t {
    // light of ambient sources, which no lobe reflects
    Ambient,
    // whole terms: light from everywhere through a lobe
    Indirect, // what other lobes bring anyway
    Diffuse,
    DiffuseBehind, // of the side that N points away from: it comes through
    Specular,
    Phong,
    Mirror,
    Refraction,
    Environment,
    Aimed, // along a direction that does not depend on the view
    // factors, which make a term by two: the light of one direction, and what a lobe does with it
    Light,
    CosineKernel,
    CosineBehind,
    SpecularKernel,
    PhongKernel,
    // factors of whole terms: Fresnel's reflected and transmitted parts
    FresnelReflect,
    FresnelTransmit,
    // terms with such a factor
    DielectricMirror,
    DielectricTransmit,
    DielectricGlossy,
    // a direction to a light: nothing is known of it
    LightDirection,
    // the light of one of the directions that stand for all, in a loop whose kernel is no lobe's
    LightSample,
};

enum class CallKind : uint8_t {
    Dx,
    Dy,              // differences to the next vertex in u, in v; imm: 1 + Input, if it is that of one
    CalculateNormal, // P, N
    Texture,         // channels = imm; see Call arguments in runtime.cpp
    Environment,
    SpaceMatrix, // from, to
    Printf,
    Format,
    Concat,
    Match,
    Report,
    Found,  // attribute, option, rendererinfo, textureinfo: is it known? imm: sl::Query::Kind * 4 + what is
            // wanted
    Query,  // its value
    Lights, // how many there are, for shaders that look at them one by one
    LightDirection,
    LightColor, // of one, at a point: the way to it, Cl
    CreateBoundary,
    AddLobe,
    AddLayer,
    CreateInterior,
    AddPhaseFunction,
    SetPhaseFunction,
    SetAbsorption,
    SetScattering,
    SetPriority,
};

struct CallSite {
    CallKind kind;
    Loc loc;
    Ref result = None;
    std::vector<Ref> args;
    std::vector<std::string> names; // of the arguments, where they have one
    int imm = 0;                    // lobe, channels, …
    bool frozen = false;            // seen by the dicing camera on purpose: no word of it
};

struct Instr {
    Op op;
    Ty ty = Ty::Void;
    bool varying = false;
    int imm = 0;
    Loc loc;
    std::vector<Ref> args;
    std::vector<float> floats; // Const
    std::string text;          // Text; of others: the source's name for the value, if it has one
};

struct Var {
    std::string name;
    Ty ty = Ty::Float;
    int array = 0; // elements; 0 = not an array
    bool varying = false;
    bool must_be_uniform = false; // declared so
    bool clear = false;           // an array whose elements are zero when it comes to life
    bool counts = false;          // of the compiler's own: no light, whatever conditions change it
    Loc loc;
    int context = -1; // masks: where it was declared
};

struct Block;

struct Item {
    enum Kind : uint8_t {
        Instruction, // ref
        If,          // ref: condition; body, orelse
        Loop,        // body, for ever: left by jumps
        Scope,       // target; body: jumps to the target end here
        Jump,        // target
        Declare,     // target: variable comes to life
        // made by masks.cpp
        Guard,     // target: mask variable; body runs if any lane is on
        LeaveLoop, // target: mask variable; leaves the innermost Loop if no lane is on
    };
    Kind kind;
    Ref ref = None;
    int target = -1;
    Block* body = nullptr;
    Block* orelse = nullptr;
    Loc loc;
    bool masked = false; // Loop: lanes leave it one by one. Scope: lanes jump to its end one by one
    int fault = -1;      // Loop: what to report when it does not end
    Ref light = None;    // Scope of an illuminance loop that runs over directions: the LightSample it adds to
};

struct Block {
    std::vector<Item> items;
};

// What a light shader's stage hands out; all but Color belong to the light as a whole.
enum class Emission : uint8_t { Color, Form, From, Axis, Angle, Count };

// What a stage hands out: a variable's value at its end.
struct Output {
    enum Kind : uint8_t { Position, Normal, Slot, Member, Parameter, Aov, Emitted, Filtered, Carried };
    Kind kind = Slot;
    int var = -1;
    // Slot: channel; Member, Parameter, Aov, Carried: index (Carried: of a parameter); Emitted: Emission;
    // Filtered: 0 Ci, 1 Oi, 2 alpha
    int index = 0;
    int element = 0; // Parameter: of an array
};

// One stage of a shader.
struct Stage {
    std::string name;
    std::vector<Instr> instrs;
    std::vector<Var> vars;
    std::deque<Block> blocks;
    Block* root = nullptr;
    std::vector<CallSite> calls;
    std::vector<Output> outputs;
    std::vector<std::pair<Loc, std::string>> faults; // places where a run-time fault may arise
    int targets = 0;
    grid::Reads reads; // set when the program is complete (reads.cpp)

    Block* block() { return &blocks.emplace_back(); }
    Stage() = default;
    Stage(const Stage& other) { *this = other; }
    Stage& operator=(const Stage& other); // deep: blocks point at each other
};

// A parameter or member in the block of floats that stages read: its place there.
struct Place {
    int offset = 0; // in floats, or in strings
    int count = 0;
    bool text = false;
    bool varying = false; // may be bound to a primvar
    int length = -1;      // in floats: of a resizable array the number of its elements; of a parameter whose
                          // default varies, whether it was given a value
};

// Values that a resizable array parameter holds at most, and what a growing array has room for where its uses
// do not say.
inline constexpr int ResizableRoom = 64;
// Iterations of all loops together, in one run of one stage over one grid, after which they are left.
inline constexpr int64_t LoopBudget = 10'000'000;
// And those of one loop by itself.
inline constexpr int64_t LoopPatience = 100'000;

// One number or colour of the material: written by SetLobe, or a part of an extracted closure.
struct Channel {
    std::string node; // the leaf or layer it belongs to
    int input = -1;   // of the lobe; -1 = weight
    grid::LobeId lobe = grid::LobeId::LambertBrdf;
    bool presence = false;
    bool ambient = false; // how much of the light of ambient sources it shows
    Ty ty = Ty::Float;
    bool unsure = false; // set by a name that only the run time knows to have been added
    int8_t opacity = -1; // which component of Oi it is
    bool as_os = false;  // that has all components alike where Os has
};

struct Program {
    ShaderKind kind = ShaderKind::Class;
    std::string name;
    std::vector<Parameter> parameters;
    std::vector<Place> places; // of parameters
    // How many parameters at the end of the list are none of the source: members of a class that its
    // displacement leaves to its surface, which takes them from the grid as it does primvars.
    int carried = 0;
    int floats = 0, strings = 0; // sizes of the parameter block
    std::vector<Place> members;
    int member_floats = 0, member_strings = 0;
    std::vector<Channel> channels;
    // Stages that the shader lacks have no root. defaults: parameters' values that only the run time can
    // compute.
    Stage defaults, init, interior, displace, shade, light, filter;
    // Variables of the shade stage that a surface leaves its result in; -1 = it sets lobes itself.
    int Ci = -1, Oi = -1;
    // Fixed layering of a classic surface, in order; class shaders make theirs in init.
    std::vector<std::pair<std::string, grid::LobeId>> fixed_lobes;
    std::vector<std::string> aovs;  // output parameters that the shade stage hands out
    bool area_light = false;        // see CompileOptions; of use while lowering alone
    bool rispec_specular = false;   // the same
    bool gathers_light = false;     // the same
    bool own_light = false;         // illuminance loops that are no lobe's
    std::vector<std::string> files; // names of the sources, for locations at run time
    std::vector<TextureUse> textures;
    bool queries = false;         // asks for attributes, options or the like
    bool interreflection = false; // asks for light between surfaces, or what keeps it away: occlusion()
    CoShaderUse coshaders = CoShaderUse::None;
    uint64_t source_hash = 0;

    std::array<Stage*, 7> stages() {
        return {&defaults, &init, &interior, &displace, &shade, &light, &filter};
    }
    std::array<const Stage*, 7> stages() const {
        return {&defaults, &init, &interior, &displace, &shade, &light, &filter};
    }
};

std::string dump(const Stage& stage); // for tests
const char* op_name(Op op);

} // namespace kanuka::sl::ir
