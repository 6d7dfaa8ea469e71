#include "scene/scene.h"

namespace kanuka::scene {

Basis basis_by_name(std::string_view name) {
    const float s = 1.0f / 6, h = 0.5f;
    if (name == "bezier")
        return {{{{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}}}, 3};
    if (name == "b-spline")
        return {
            {{{-s, 3 * s, -3 * s, s}, {3 * s, -6 * s, 3 * s, 0}, {-3 * s, 0, 3 * s, 0}, {s, 4 * s, s, 0}}},
            1};
    if (name == "catmull-rom")
        return {{{{-h, 3 * h, -3 * h, h}, {2 * h, -5 * h, 4 * h, -h}, {-h, 0, h, 0}, {0, 1, 0, 0}}}, 1};
    if (name == "hermite")
        return {{{{2, 1, -2, 1}, {-3, -2, 3, -1}, {0, 1, 0, 0}, {1, 0, 0, 0}}}, 2};
    if (name == "power")
        return {{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}, 4};
    throw Error("unknown basis \"" + std::string(name) +
                "\"; one of bezier, b-spline, catmull-rom, hermite, power");
}

} // namespace kanuka::scene
