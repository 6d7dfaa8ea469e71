#include "color/palette.h"

#include <bit>
#include <cmath>
#include <mutex>

namespace kanuka::color {

namespace {

Table times(const Table& a, const Table& b) {
    Table r;
    for (int i = 0; i < LambdaCount; i++)
        r[i] = a[i] * b[i];
    return r;
}

float evaluate(const std::array<float, 3>& c, int i) {
    return uplift_eval(c, LambdaMin + float(i));
}

} // namespace

Palette::Palette(Space space)
    : m_space(info(space).scene_linear ? space : Space::Rec709), m_uplift(&color::uplift_table(m_space)) {}

const Palette::Token* Palette::find(const Rgb& rgb, float& factor) const {
    const float m = std::max({rgb.x, rgb.y, rgb.z});
    if (!(m > 0) || !std::isfinite(m))
        return nullptr;
    for (const Token& t : m_tokens) {
        const float k = m / std::max({t.rgb.x, t.rgb.y, t.rgb.z});
        constexpr float Same = 1e-6f;
        if (std::abs(rgb.x - k * t.rgb.x) <= Same * m && std::abs(rgb.y - k * t.rgb.y) <= Same * m &&
            std::abs(rgb.z - k * t.rgb.z) <= Same * m) {
            factor = k;
            return &t;
        }
    }
    return nullptr;
}

Palette::Coefficients Palette::reflectance(const Rgb& rgb, float scale) const {
    if (m_any.load(std::memory_order_acquire)) {
        const std::shared_lock lock(m_mutex);
        float factor = 0;
        if (const Token* t = find(rgb, factor); t && t->reflectance >= 0)
            return {float(t->reflectance), TableMark, 0, factor};
    }
    const auto c = uplift(rgb * (1 / scale), *m_uplift);
    return {c[0], c[1], c[2], scale};
}

Palette::Coefficients Palette::emission(const Rgb& rgb, float scale) const {
    if (m_any.load(std::memory_order_acquire)) {
        const std::shared_lock lock(m_mutex);
        float factor = 0;
        if (const Token* t = find(rgb, factor); t && t->emission >= 0)
            return {float(t->emission), TableMark, 0, factor};
    }
    const auto c = uplift(scale > 0 ? rgb * (1 / scale) : Rgb(0), *m_uplift);
    return {c[0], c[1], c[2], scale};
}

Rgb Palette::add_token(Rgb rgb, const Table* reflectance, const Table* emission) {
    const float m = std::max({rgb.x, rgb.y, rgb.z});
    if (!(m > 0)) // black, or NaN
        return Rgb(0);
    for (int c = 0; c < 3; c++)
        rgb[c] = std::max(rgb[c], 1e-4f * m);
    // Metamers have one colour: each spectrum moves its own by up to 1e-4, after what is in it, so that they
    // are told apart, and in the same way in whatever order they come.
    uint64_t hash = 0xcbf29ce484222325;
    for (const Table* t : {reflectance, emission})
        for (int i = 0; t && i < LambdaCount; i++)
            hash = (hash ^ std::bit_cast<uint32_t>((*t)[i])) * 0x100000001b3;
    const Rgb plain = rgb;
    const std::unique_lock lock(m_mutex);
    while (true) {
        for (int c = 0; c < 3; c++)
            rgb[c] = plain[c] * (1 + 1e-4f * (float(hash >> (20 * c) & 0xffff) / 32768 - 1));
        float factor = 0;
        const Token* t = find(rgb, factor);
        if (!t)
            break;
        const bool same_reflectance =
            reflectance ? t->reflectance >= 0 && m_tables[size_t(t->reflectance)] == *reflectance
                        : t->reflectance < 0;
        if (same_reflectance && m_tables[size_t(t->emission)] == *emission)
            return t->rgb;
        hash = (hash ^ hash >> 31) * 0x9e3779b97f4a7c15;
    }
    Token token{rgb, -1, -1};
    if (reflectance) {
        token.reflectance = int(m_tables.size());
        m_tables.push_back(*reflectance);
    }
    token.emission = int(m_tables.size());
    m_tables.push_back(*emission);
    m_tokens.push_back(token);
    m_any.store(true, std::memory_order_release);
    return rgb;
}

Rgb Palette::add_reflectance(const Table& reflectance) {
    const Table lit = times(reflectance, white());
    return add_token(transform(space_from_xyz(m_space),
                               [&] {
                                   const Vector3 xyz = observe(lit);
                                   return Rgb(float(xyz[0]), float(xyz[1]), float(xyz[2]));
                               }()),
                     &reflectance, &lit);
}

Rgb Palette::add_light(const Table& power) {
    if (power == white())
        return Rgb(1);
    const Vector3 xyz = observe(power);
    return add_token(transform(space_from_xyz(m_space), {float(xyz[0]), float(xyz[1]), float(xyz[2])}),
                     nullptr, &power);
}

Rgb Palette::add_light(const Table& power, const Rgb& filter) {
    if (power == white())
        return filter;
    const float m = std::max({filter.x, filter.y, filter.z});
    if (!(m > 0) || !std::isfinite(m))
        return Rgb(0);
    if (filter == Rgb(m))
        return add_light(power) * m;
    const Coefficients c = reflectance(filter, 2 * m);
    Table t;
    if (c[1] == TableMark) {
        const std::shared_lock lock(m_mutex);
        for (int i = 0; i < LambdaCount; i++)
            t[i] = power[i] * c[3] * m_tables[size_t(c[0])][i];
    } else
        for (int i = 0; i < LambdaCount; i++)
            t[i] = power[i] * c[3] * evaluate({c[0], c[1], c[2]}, i);
    return add_light(t);
}

Rgb Palette::add_named(const std::string& name, std::span<const std::string> folders) {
    NamedSpectrum s = resolve_spectrum(name, folders);
    if (s.illuminant)
        return add_light(s.table);
    // Instruments measure white tiles at a little above 1; far above, the numbers are something else.
    constexpr float Reflects = 1.2f;
    const float most = *std::max_element(s.table.begin(), s.table.end());
    if (most > Reflects)
        throw Error("the spectrum \"" + name.substr(0, 60) + "\" reaches " + std::to_string(most) +
                    ", but a reflectance lies between 0 and 1; divide percents by 100");
    for (float& v : s.table)
        v = std::min(v, 1.0f);
    return add_reflectance(s.table);
}

Table Palette::emitted(const Coefficients& c) const {
    Table t;
    if (c[1] == TableMark) {
        const std::shared_lock lock(m_mutex);
        for (int i = 0; i < LambdaCount; i++)
            t[i] = c[3] * m_tables[size_t(c[0])][i];
    } else
        for (int i = 0; i < LambdaCount; i++)
            t[i] = c[3] * evaluate({c[0], c[1], c[2]}, i) * white()[i];
    return t;
}

std::optional<Palette::Coefficients> Palette::sum(std::span<const Rgb> emissions) {
    Table total{};
    bool tabled = false;
    for (const Rgb& rgb : emissions) {
        const Coefficients c = emission(rgb, 2 * std::max({rgb.x, rgb.y, rgb.z, 0.0f}));
        tabled |= c[1] == TableMark;
        const Table t = emitted(c);
        for (int i = 0; i < LambdaCount; i++)
            total[i] += t[i];
    }
    if (!tabled)
        return std::nullopt;
    const std::unique_lock lock(m_mutex);
    m_tables.push_back(total);
    return Coefficients{float(m_tables.size() - 1), TableMark, 0, 1};
}

std::vector<float> Palette::tables() const {
    const std::shared_lock lock(m_mutex);
    std::vector<float> all;
    all.reserve(m_tables.size() * TableStride);
    for (const Table& t : m_tables)
        for (int i = 0; i < TableStride; i++)
            all.push_back(t[size_t(std::min(i, LambdaCount - 1))]);
    return all;
}

} // namespace kanuka::color
