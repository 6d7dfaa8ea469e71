#include "render/albedo.h"

#include <algorithm>

#include "bsdf/material.h"
#include "color/sensor.h"
#include "transport/fetch.h"
#include "transport/hit_place.h"

namespace kanuka::render {

namespace {

using F = Float<1>;
using I = Int<1>;

// A vertex of a record, where nothing lies between vertices.
struct AtVertex {
    transport::ShapeLanes<1> shape;
    transport::HitPlace<1> place;

    AtVertex(const store::Store& store, const bsdf::MaterialCode& code, int index, int vertex)
        : shape(reinterpret_cast<const int32_t*>(store.shapes().data()), I(index)),
          place(code.page_words, shape, I(0), F(0.0f), F(0.0f)) {
        for (int k = 0; k < 4; k++) {
            place.vertex[k] = I(vertex);
            place.weight[k] = F(k == 0 ? 1.0f : 0.0f);
        }
    }
};

} // namespace

Albedos::Albedos(const store::Store& store, const color::Palette& palette)
    : m_store(store), m_tables(palette.tables()) {
    for (size_t i = 0; i < store.programs().size(); i++)
        m_codes.emplace_back(store.programs()[i], store.words(int(i)));
    const color::UpliftTable& uplift = palette.uplift_table();
    m_view.spectra.uplift = {uplift.coefficients.data(), uplift.resolution, uplift.z_factor, uplift.z_offset};
    m_view.spectra.tables = m_tables;
    // Bands of the same width where the eye sees; what lies beyond counts with the first and the last.
    const color::Sensor sensor =
        color::make_sensor(color::Observer::Cie1931, palette.white(), color::Space::Rec709);
    constexpr float First = 395, Last = 715, Width = (Last - First) / float(Bands);
    std::array<std::array<double, 3>, Bands> share{};
    std::array<double, 3> whole{};
    const color::Table& white = palette.white();
    for (size_t nm = 0; nm < white.size(); nm++) {
        const float band = (float(nm) + 360.0f - First) / Width;
        const auto b = size_t(std::clamp(band, 0.0f, float(Bands) - 0.5f));
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < 3; k++) {
                const double seen = double(sensor.output_from_sensor[c][k]) * double(sensor.curves[k][nm]) *
                                    double(white[nm]);
                share[b][c] += seen, whole[c] += seen;
            }
    }
    for (size_t b = 0; b < Bands; b++) {
        m_wavelengths[b] = (First + (float(b) + 0.5f) * Width - 360.0f) / 470.0f;
        for (size_t c = 0; c < 3; c++)
            m_share[b][c] = float(share[b][c] / whole[c]);
    }
}

Rgb Albedos::at(int shape, int vertex) const {
    const bsdf::MaterialCode& code = m_codes[size_t(m_store.shapes()[size_t(shape)].program)];
    if (code.leaves == 0)
        return Rgb(0.0f);
    const AtVertex at(m_store, code, shape, vertex);
    const Vec3<F> along(F(0.0f), F(0.0f), F(1.0f));
    Rgb sum(0.0f);
    for (size_t b = 0; b < Bands; b += bsdf::Wavelengths) {
        F l[bsdf::Wavelengths];
        for (size_t k = 0; k < bsdf::Wavelengths; k++)
            l[k] = F(m_wavelengths[b + k]);
        const transport::InputFetch<1> fetch(m_view, code, at.shape, at.place, l);
        const bsdf::Material<1> material(code, fetch, Mask<1>(true), along, l);
        for (size_t k = 0; k < bsdf::Wavelengths; k++) {
            const float a = material.albedo()[int(k)][0];
            for (size_t c = 0; c < 3; c++)
                sum[int(c)] += a * m_share[b + k][c];
        }
    }
    for (int c = 0; c < 3; c++)
        sum[c] = sum[c] > 0 ? std::min(sum[c], 1.0f) : 0.0f; // not a number is 0
    return sum;
}

Vec3f Albedos::normal(int shape, int vertex) const {
    const bsdf::MaterialCode& code = m_codes[size_t(m_store.shapes()[size_t(shape)].program)];
    const AtVertex at(m_store, code, shape, vertex);
    F l[bsdf::Wavelengths] = {F(0.0f), F(0.0f), F(0.0f), F(0.0f)};
    const Vec3<F> n = transport::InputFetch<1>(m_view, code, at.shape, at.place, l).normal(at.shape);
    return {n.x[0], n.y[0], n.z[0]};
}

bool Albedos::varies(int shape) const {
    const store::ShapeRecord& s = m_store.shapes()[size_t(shape)];
    const uint32_t* table = m_store.words(s) + s.slot_table;
    const auto differs = [&](const bsdf::MaterialCode::Place& place) {
        return place.word >= 0 && table[2 * place.word + 1] != 0;
    };
    for (const bsdf::MaterialCode::Node& n : m_codes[size_t(s.program)].nodes) {
        if (differs(n.weight))
            return true;
        for (int i = 0; i < n.input_count; i++)
            if (differs(n.inputs[i]))
                return true;
    }
    return false;
}

} // namespace kanuka::render
