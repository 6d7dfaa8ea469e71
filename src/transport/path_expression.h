// Light path expressions: regular expressions over what happens to a path between the camera and a light
// (Heckbert 1990, Adaptive Radiosity Textures for Bidirectional Ray Tracing), in the notation of RenderMan
// and OSL. docs/transport.md, "Light path expressions", has it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kanuka::transport {

// One step of a path. Of surfaces: what the light does, and the kind of lobe that does it.
enum class PathStep : uint8_t {
    Camera,
    ReflectDiffuse,
    ReflectGlossy,
    ReflectSingular, // of one direction, as a mirror
    TransmitDiffuse,
    TransmitGlossy,
    TransmitSingular,
    Volume,
    Count
};

// What ends a path, by number: lights, beside those of LightsView::analytic.
struct LightId {
    static constexpr int Surface = -1; // what shines of itself and is no emitter of the store: air
    static constexpr int Picture = -2, Constant = -3, Ambient = -4;
    static constexpr int Unnamed = -5; // a light that no group has
    static constexpr int Least = -5;
    // An emitter of the store: an area light, or what shines of itself. Both who samples light and who hits
    // it say this, so both parts of MIS count for the same expressions.
    template <class I>
    static I of_emitter(I emitter) {
        return I(Least - 1) - emitter;
    }
};

// A deterministic automaton that reads a path from the camera on. Its first state is the one behind the
// camera.
struct PathAutomaton {
    static constexpr uint8_t Dead = 0xff; // no light behind it counts
    static constexpr size_t MostStates = 64;
    struct State {
        std::array<uint8_t, size_t(PathStep::Count)> next;
        uint64_t accepts; // bits by class of light
    };
    std::vector<State> states;
};

// By which expressions name a light: its name or handle, and its groups, parted by blanks.
struct LightLabel {
    std::string name, group;
    auto operator<=>(const LightLabel&) const = default;
};

// The names of the lights of each class, by which expressions mean them. Class 0 is what shines of itself.
using LightNames = std::vector<std::string>;

// Throws Error: the column, what is there and what was expected, and the text with a caret.
PathAutomaton compile_path_expression(std::string_view text, std::span<const LightNames> classes);
// The names of lights that it has. Throws as well.
std::vector<std::string> names_in_path_expression(std::string_view text);

// Several, and what they know of the lights of a scene.
struct PathExpressions {
    std::vector<PathAutomaton> automata;
    std::vector<uint8_t> class_of_light;   // by light - LightId::Least
    std::vector<uint8_t> class_of_emitter; // of the store
    int first_channel = 0;                 // of the AOVs: three for each expression

    uint64_t class_bit(int light) const {
        const uint8_t of = light < LightId::Least ? class_of_emitter[size_t(LightId::Least - 1 - light)]
                                                  : class_of_light[size_t(light - LightId::Least)];
        return uint64_t(1) << of;
    }
};

} // namespace kanuka::transport
