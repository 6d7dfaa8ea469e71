#include "grid/grid.h"

namespace kanuka::grid {

void Grid::allocate(int cells_u, int cells_v) {
    nu = cells_u;
    nv = cells_v;
    stride = (vertices() + LanePadding - 1) / LanePadding * LanePadding;
    for (auto* a : {&P, &N, &Ng, &dPdu, &dPdv})
        a->assign(size_t(stride) * 3, 0.0f);
    for (auto* a : {&u, &v, &s, &t})
        a->assign(size_t(stride), 0.0f);
}

void carry_normals(Grid& g, const std::vector<float>& before) {
    const size_t n = size_t(g.stride);
    const auto at = [&](const std::vector<float>& a, size_t i) {
        return Vec3f{a[i], a[i + n], a[i + 2 * n]};
    };
    const auto unit = [](const Vec3f& v) {
        const float l = length(v);
        return l > 0 ? v * (1 / l) : v;
    };
    for (Grid::Step& step : g.later)
        for (size_t i = 0; i < size_t(g.vertices()); i++) {
            const Vec3f shaded = at(g.N, i), was = at(before, i);
            if (shaded == was)
                continue;
            const Vec3f a = unit(was), b = unit(at(step.N, i)), axis = cross(a, b);
            const float cosine = dot(a, b);
            // Rodrigues' formula with (1 - cos) / sin^2 = 1 / (1 + cos).
            Vec3f turned = shaded;
            if (cosine > -0.999f)
                turned += cross(axis, shaded) + cross(axis, cross(axis, shaded)) * (1 / (1 + cosine));
            else
                turned = -shaded;
            for (int c = 0; c < 3; c++)
                step.N[i + size_t(c) * n] = turned[c];
        }
}

} // namespace kanuka::grid
