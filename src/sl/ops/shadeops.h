// The one table of shadeops: names, signatures, documentation and implementation. Sema resolves calls with
// it, lowering implements them with it, and docs/shadeops.md is printed from it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sl/ir/ir.h"
#include "sl/parse/ast.h"

namespace kanuka::sl::ops {

enum class Impl : uint8_t {
    Primitive, // one IR operation, componentwise if its arguments are triples
    Source,    // RSL: the row's source
    Special,   // what lowering does for it: see enum Special
    Closure,   // light that is not known yet
    Noise,
};

// What a row of Impl::Special is lowered to. Those that differ in the call to the host alone, or in what they
// ask of it, share one: the row's imm is the ir::CallKind or the Query::Kind.
enum class Special : uint8_t {
    Absent, // nothing is there: 0
    Host,   // a call of its arguments
    Query,
    // values
    Spline,
    Component,
    SetComponent,
    Determinant,
    Space,
    Difference,
    CalculateNormal,
    Random,
    ShaderName,
    Texture,
    Environment,
    PointCloud,
    Emit,
    RayInfo,
    // arrays
    ArrayLength,
    ArrayCapacity,
    Push,
    Pop,
    Resize,
    Reserve,
    // co-shaders
    GetShader,
    GetShaders,
    GetLights,
    GetVariable,
    HasMethod,
    // materials
    Create,
    AddLayer,
    AddNode,
    SetLobe,
    SetLayer,
    SetPresence,
    SetInterior,
};

// What a shadeop makes, in surfaces, of directions to the light and the eye and of their cosines.
enum class Optics : uint8_t {
    None,
    Fresnel,
    Occlusion,
    Normalize,
    Length,
    FaceForward,
    TransformVector,
    Reflect,
    Refract,
    SpecularBrdf,
    Exponential,
    SmoothStep,
    Limit,
    Power,
};

struct Argument {
    ast::Type type;
    bool output = false;
    std::string name;
};

struct Signature {
    ast::Type result;
    std::vector<Argument> args;
    bool variadic = false; // further arguments, or name and value pairs, may follow
    Impl impl = Impl::Special;
    Special special = Special::Absent;
    ir::Op op = ir::Op::Const;
    int imm = 0;
    std::string source; // Impl::Source: the whole function
};

struct Shadeop {
    std::string name, category, doc;
    Optics optics = Optics::None;
    std::vector<Signature> signatures;
};

std::span<const Shadeop> shadeops();
const Shadeop* find_shadeop(std::string_view name);
std::string shadeops_manual(); // Markdown

// Names for a spline's basis: its 4x4 matrix by rows (coefficients of t^3, t^2, t, 1) and its step, null if
// unknown.
struct SplineBasis {
    float m[4][4];
    int step;
};
const SplineBasis* find_basis(std::string_view name);

// ---- the variables that every shader sees
// --------------------------------------------------------------------------

struct Global {
    std::string_view name;
    ast::Base type;
    int input;    // ir::Input; -1 = special
    bool written; // by a shader
    std::string_view doc;
};
std::span<const Global> globals();

} // namespace kanuka::sl::ops
