#include "shade/area_light.h"

#include <algorithm>
#include <cmath>

namespace kanuka::shade {

sl::Emission run_area_light(const sl::Instance& shader, const grid::Grid& grid,
                            const sl::GridGlobals& globals, sl::Services& services) {
    // Unit normals; where shading has none, the surface's.
    grid::Grid points = grid;
    for (int i = 0; i < points.vertices(); i++) {
        Vec3f n = points.normal(i);
        if (!(dot(n, n) > 0))
            for (int c = 0; c < 3; c++)
                n[c] = points.Ng[size_t(c) * size_t(points.stride) + size_t(i)];
        n = dot(n, n) > 0 ? normalize(n) : Vec3f(0, 0, 1);
        for (int c = 0; c < 3; c++)
            points.N[size_t(c) * size_t(points.stride) + size_t(i)] = n[c];
    }
    sl::Emission emission = shader.emit(points, globals, services);
    emission.Cl.resize(3 * size_t(grid.stride));
    for (float& x : emission.Cl)
        x = std::isfinite(x) ? std::max(x, 0.0f) : 0.0f;
    return emission;
}

float cone_of(const sl::Emission& emission) {
    const bool cone = emission.form == sl::Emission::Illuminate && length(emission.axis) > 0;
    return cone && emission.angle < 0.5f * Pi ? std::cos(std::max(emission.angle, 0.0f)) : 0.0f;
}

} // namespace kanuka::shade
