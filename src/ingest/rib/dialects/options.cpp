#include "ingest/rib/dialects/options.h"

#include <algorithm>
#include <cmath>

namespace kanuka::ingest::dialects {

namespace {

constexpr std::string_view PrmanDepth = "trace:maxdepth", BmrtDepth = "render:max_raylevel";

// How often rays may go on from surfaces: 0 = only the camera's are traced, and a path has one surface event.
std::optional<std::string> ray_depth(scene::Options& to, const scene::Value& v) {
    const float n = !v.ints.empty() ? float(v.ints[0]) : !v.floats.empty() ? v.floats[0] : NAN;
    if (v.type == scene::Type::String || !(n >= 0))
        return "must be a whole number of 0 or more";
    to.max_depth = int(std::min(n, 999.0f)) + 1;
    return std::nullopt;
}

} // namespace

std::optional<std::string> option(scene::Options& to, std::string_view name, const scene::Value& value) {
    if (name == PrmanDepth || name == BmrtDepth)
        return ray_depth(to, value);
    return std::nullopt;
}

} // namespace kanuka::ingest::dialects
