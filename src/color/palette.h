// The colours of a scene as spectra. A shader works with RGB; a measured spectrum travels through it as the
// RGB that it looks like, and is known by that RGB afterwards: an input that came out as any multiple of it,
// to a few units of the last place, is that multiple of the spectrum. So metamers stay metamers through any
// shader that scales its colours, and what a shader mixes is uplifted as every other colour is.
#pragma once

#include <atomic>
#include <deque>
#include <shared_mutex>

#include "color/illuminants.h"
#include "color/spaces.h"

namespace kanuka::color {

// Thread safety: all members may be called from any thread.
class Palette {
  public:
    static constexpr int TableStride = 480; // floats of a table in `tables`: 471, the last one repeated
    explicit Palette(Space space = Space::Rec709);
    Space space() const { return m_space; }
    const UpliftTable& uplift_table() const { return *m_uplift; }
    const Table& white() const { return white_illuminant(m_space); } // the spectrum of emitted (1, 1, 1)

    // c0, c1, c2 and scale: scale * S(lambda; c), for a reflectance; times white(), for emission. Where c1 is
    // TableMark, scale times table number c0 at once.
    static constexpr float TableMark = 3e38f;
    using Coefficients = std::array<float, 4>;
    Coefficients reflectance(const Rgb& rgb, float scale) const; // of rgb / scale, times scale
    Coefficients emission(const Rgb& rgb, float scale) const;

    // Registers a spectrum; returns the RGB that stands for it. No component is negative: a colour outside
    // the space is stood for by its nearest inside. A light is white() times a filter, or any power with
    // Y = 1. The same spectrum again gets the same RGB.
    Rgb add_reflectance(const Table& reflectance);
    Rgb add_light(const Table& power);
    // A light behind a filter: the table of their product. `filter` is uplifted, and may exceed 1.
    Rgb add_light(const Table& power, const Rgb& filter);
    // Names of a scene; throws Error as resolve_spectrum does. A named illuminant is a light, all else a
    // reflectance.
    Rgb add_named(const std::string& name, std::span<const std::string> folders);

    // Sum of emissions, where one is a table; none where plain RGB will do.
    std::optional<Coefficients> sum(std::span<const Rgb> emissions);
    std::vector<float> tables() const; // TableStride floats each, all that were registered
    // At 1 nm, white() included.
    Table emitted(const Coefficients& c) const;

  private:
    struct Token {
        Rgb rgb;
        int reflectance, emission; // tables; -1 = none
    };
    const Token* find(const Rgb& rgb, float& factor) const;
    Rgb add_token(Rgb rgb, const Table* reflectance, const Table* emission);

    Space m_space;
    const UpliftTable* m_uplift;
    mutable std::shared_mutex m_mutex;
    std::atomic<bool> m_any{false}; // tokens: most scenes have none
    std::deque<Token> m_tokens;
    std::deque<Table> m_tables;
};

} // namespace kanuka::color
