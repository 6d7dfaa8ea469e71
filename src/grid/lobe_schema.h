// What a lobe declares, and lookups while running; the declarations are in lobe_table.h.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "base/vec.h"

namespace kanuka::grid {

enum class InputType : uint8_t { Float, Color, Normal };

constexpr int components_of(InputType type) {
    return type == InputType::Float ? 1 : 3;
}

// How an input that varies over a grid is kept at a vertex. Everything is a part of a 32-bit word; floats
// share a word two by two. An input that is constant over a grid is kept once, unquantised.
enum class Storage : uint8_t {
    Color,  // in [0, 1], and
    Amount, // >= 0 without upper bound: nine bits a component and a shared exponent. One word
    Half,   // float: half precision. Half a word
    Full,   // float: as it is. One word; for directions, and values that are shown and not shaded with
    Unit,   // a unit vector, on the octahedron. One word
};

// What lies between the values of an input at vertices.
enum class Between : uint8_t {
    Linear,
    Turns,  // of something without a direction, as grooves: half a turn is none, and the shorter way is taken
    Nearest // codes: what they name has nothing between
};

struct LobeInput {
    std::string_view name;
    InputType type;
    Vec3f fallback;  // the default; x alone for floats
    float low, high; // values outside are clamped, and reported once
    std::string_view unit;
    Storage storage;
    std::string_view doc;
    std::span<const std::string_view> names = {}; // of the values 0, 1, …: a string may be given for one
    bool body = false; // the colour that a thing has, which the tint of an instance multiplies
    constexpr Between between() const {
        return unit == "turns" ? Between::Turns : names.empty() ? Between::Linear : Between::Nearest;
    }
};

enum class LobeKind : uint8_t { Reflection, Transmission, ReflectionTransmission, Emission, Phase };

// The order here is the order of schema::table.
enum class LobeId : uint8_t {
    LambertBrdf,
    LambertBtdf,
    OrenNayarBrdf,
    BurleyBrdf,
    SheenBrdf,
    MicrofacetConductorBrdf,
    MetalBrdf,
    RetroBrdf,
    MicrofacetDielectricBrdf,
    MicrosurfaceDielectricBsdfRgb_v1,
    ThinWalledDielectricBsdf,
    GratingBrdf,
    PhongBrdf,
    BlinnBrdf,
    HighlightBrdf,
    AimedBsdf,
    DiffuseEmission,
    ConeEmission,
    ProfileEmission,
    HenyeyGreensteinPfrgb,
    DoubleHenyeyGreensteinPfrgb,
    RayleighPfrgb,
    DrainePfrgb,
    MiePfrgb,
    Count
};

struct LobeDecl {
    LobeId id;
    std::string_view name; // the type's name in the shading language
    LobeKind kind;
    std::span<const LobeInput> inputs;
    std::string_view doc;
    bool reciprocal = true;
    bool lossless = false; // with white colours and all else as it may be, all light comes back
};

std::span<const LobeDecl> lobe_table();
const LobeDecl& lobe(LobeId id);
const LobeDecl* find_lobe(std::string_view name);            // null = no such lobe
int find_input(const LobeDecl& lobe, std::string_view name); // -1 = no such input

} // namespace kanuka::grid
