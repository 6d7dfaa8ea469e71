// Light path expressions as trees: what was written, before the lights of a scene are known.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "transport/path_expression.h"

namespace kanuka::transport {

// Kinds of events, a bit each: those of PathStep, then what ends a path.
using EventKinds = uint32_t;
constexpr EventKinds kind_of(PathStep step) {
    return EventKinds(1) << int(step);
}
inline constexpr EventKinds ObjectKind = EventKinds(1) << int(PathStep::Count), // shines of itself
    LightKind = ObjectKind << 1, AllKinds = 2 * LightKind - 1;

// The events that one place of an expression stands for: those of any part, or all others.
struct EventSet {
    struct Part {
        EventKinds kinds = 0;
        std::optional<std::string> name; // then lights of that name alone
    };
    std::vector<Part> parts;
    bool complement = false;
};

struct PathSyntax {
    enum class Kind : uint8_t { Events, Sequence, Choice, Repeat };
    Kind kind = Kind::Sequence;            // without children: nothing
    EventSet events = {};                  // of Events
    std::vector<PathSyntax> children = {}; // Repeat has one
    int least = 1, most = 1;               // of Repeat
    bool endless = false;                  // then most = max(least, 1), the last of which repeats
    int places = 0;                        // of Events in it, with what is repeated written out
    int depth = 1;
};

inline constexpr int MostPlacesOfExpression = 62;

// Throws Error with the column, what is there and what was expected, and a caret below the text.
PathSyntax parse_path_expression(std::string_view text);

} // namespace kanuka::transport
