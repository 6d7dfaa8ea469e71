// The sky's picture: bounded, and sampled where it is brighter than its mean.
#include <cmath>

#include "color/photometry.h"
#include "transport/lights_setup.h"

namespace kanuka::transport {

namespace {

// A sky is turned and mirrored, but never stretched: densities would have to follow. The orthogonal factor of
// the polar decomposition, by Newton's iteration (Higham 1986).
Transform nearest_rotation(Transform t) {
    t.m[0][3] = t.m[1][3] = t.m[2][3] = 0;
    const double size = std::cbrt(std::abs(t.determinant3()));
    for (auto& row : t.m)
        for (size_t c = 0; c < 3; c++)
            row[c] /= size;
    for (int k = 0; k < 32; k++) {
        const Transform inverse = t.inverse();
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c < 3; c++)
                t.m[r][c] = 0.5 * (t.m[r][c] + inverse.m[c][r]);
    }
    return t;
}

} // namespace

void fill_map(SceneData& data, const LatLong& picture, const scene::Light& light,
              const Transform& render_from_world) {
    EnvironmentMap& map = data.view.lights.map;
    std::vector<float>& rgb = data.lights.map_rgb;
    PictureCells& cells = data.lights.map_cells;
    map.width = picture.width;
    map.height = picture.height;
    map.visible_camera = light.visible_camera;
    map.sets = light.lit_sets;
    const float tint[3] = {light.amount.x, light.amount.y, light.amount.z};
    const int w = map.width, h = map.height;
    rgb.clear();
    rgb.reserve(size_t(h) * (size_t(w) + 1) * 3 + 2);
    for (int j = 0; j < h; j++)
        for (int i = 0; i <= w; i++)
            for (size_t c = 0; c < 3; c++) {
                const float v = picture.rgb[3 * (size_t(j) * size_t(w) + size_t(i % w)) + c];
                rgb.push_back(std::isfinite(v) ? std::clamp(v * tint[c], 0.0f, color::LargestRadiance)
                                               : 0.0f);
            }
    rgb.resize(rgb.size() + 2);
    const auto weight = [&](int i, int j) {
        const float* t = rgb.data() + 3 * (size_t(j) * (size_t(w) + 1) + size_t(i));
        return texel_weight(t[0], t[1], t[2]);
    };
    double sum = 0, all = 0;
    for (int j = 0; j < h; j++) {
        const double sine = std::sin(double(Pi) * (j + 0.5) / h);
        for (int i = 0; i < w; i++)
            sum += double(weight(i, j)) * sine;
        all += sine * w;
    }
    // A picture that is the same everywhere has nothing to be sampled.
    map.mean = float(sum / all * 1.0001);
    cells = make_picture_cells(
        w, h + 1,
        [&](int i, int j) { // corners: at the poles, and at texel centres
            const double theta = double(Pi) * std::clamp(j - 0.5, 0.0, double(h)) / h;
            return double(above_mean(weight(i % w, std::clamp(j - 1, 0, h - 1)), map.mean)) *
                   (j == 0 || j == h + 1 ? 0.0 : std::sin(theta));
        },
        [](int) { return 1.0; }, [&](int j) { return j == 0 || j == h ? 0.5 : 1.0; });
    if (cells.total > 0) {
        map.density = float(double(w) * h / (2 * double(Pi) * double(Pi) * cells.total));
        data.lights.map_rows = SearchGuide(cells.marginal, cells.rows);
        data.lights.map_columns = SearchGuide(cells.conditional, cells.columns);
        map.cells = {cells, data.lights.map_rows, data.lights.map_columns};
    }
    map.rgb = rgb;
    const Transform t = nearest_rotation((render_from_world * light.world_from_light).inverse());
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 3; c++)
            map.environment_from_render[3 * r + c] = float(t.m[r][c]);
}

} // namespace kanuka::transport
