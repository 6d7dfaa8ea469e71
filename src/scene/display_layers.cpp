#include "scene/display_layers.h"

#include <algorithm>

namespace kanuka::scene {

namespace {

constexpr std::string_view Letters[] = {"rgb", "rgba", "rgbz", "rgbaz", "r", "g", "b", "a", "z", "az"};
constexpr std::string_view Standard[] = {"rgb", "alpha", "albedo", "N", "Z", "P", "id"};

// The last word of a declaration is the name.
std::string_view name_of(std::string_view declaration) {
    const size_t end = declaration.find_last_not_of(" \t\n");
    if (end == std::string_view::npos)
        return {};
    const size_t space = declaration.find_last_of(" \t\n", end);
    const size_t begin = space == std::string_view::npos ? 0 : space + 1;
    return declaration.substr(begin, end + 1 - begin);
}

} // namespace

bool is_standard_layer(std::string_view name) {
    return std::ranges::find(Standard, name) != std::end(Standard);
}

std::vector<std::string> layers_of_mode(std::string_view mode) {
    std::vector<std::string> layers;
    const auto add = [&](std::string_view layer) {
        if (std::ranges::find(layers, layer) == layers.end())
            layers.emplace_back(layer);
    };
    std::string_view expression;
    if (const size_t at = mode.find(ExpressionPrefix); at != std::string_view::npos) {
        expression = mode.substr(at, mode.find_last_not_of(" \t\n") + 1 - at);
        mode = mode.substr(0, mode.substr(0, at).rfind(',') + 1); // without its declaration
        if (mode.empty())
            return {std::string(expression)};
        mode.remove_suffix(1);
    }
    while (true) {
        const size_t comma = mode.find(',');
        const std::string_view name = name_of(mode.substr(0, comma));
        if (name == "Ci") {
            add("rgb");
        } else if (name == "Oi") {
            add("alpha");
        } else if (name.empty()) { // the driver's choice
            add("rgb"), add("alpha");
        } else if (std::ranges::find(Letters, name) != std::end(Letters)) {
            if (name.find_first_of("rgb") != std::string_view::npos)
                add("rgb");
            if (name.find('a') != std::string_view::npos)
                add("alpha");
            if (name.find('z') != std::string_view::npos)
                add("Z");
        } else {
            add(name);
        }
        if (comma == std::string_view::npos) {
            if (!expression.empty())
                add(expression);
            return layers;
        }
        mode.remove_prefix(comma + 1);
    }
}

} // namespace kanuka::scene
