#include "color/spaces.h"

#include <cmath>

namespace kanuka::color {

namespace {

constexpr SpaceInfo Spaces[] = {
    {Space::Rec709, "rec709", "ITU-R BT.709, linear", Rec709Primaries, {0.3127, 0.3290}, true},
    {Space::Rec2020, "rec2020", "ITU-R BT.2020, linear", Rec2020Primaries, {0.3127, 0.3290}, true},
    {Space::AcesCg, "acescg", "ACEScg (AP1)", AcesAp1Primaries, {AcesWhite[0], AcesWhite[1]}, true},
    {Space::Aces2065, "aces2065", "ACES2065-1 (AP0)", AcesAp0Primaries, {AcesWhite[0], AcesWhite[1]}, false},
    {Space::Xyz, "xyz", "CIE XYZ", {{{1, 0}, {0, 1}, {0, 0}}}, {1 / 3.0, 1 / 3.0}, false},
};

struct Alias {
    std::string_view name;
    Space space;
};
constexpr Alias Aliases[] = {{"srgb", Space::Rec709},    {"lin_rec709", Space::Rec709},
                             {"ap1", Space::AcesCg},     {"ap0", Space::Aces2065},
                             {"aces", Space::Aces2065},  {"bt709", Space::Rec709},
                             {"bt2020", Space::Rec2020}, {"XYZ", Space::Xyz}};

Matrix3 make_rgb_from_xyz(Space space) {
    switch (space) {
    case Space::Rec709:
    case Space::Rec2020:
        return inverse(xyz_from_primaries(info(space).primaries, white_xyz(space)));
    case Space::AcesCg:
    case Space::Aces2065:
        return aces_rgb_from_xyz(info(space).primaries, white_xyz(space));
    case Space::Xyz:
        break;
    }
    return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

struct Matrices {
    Matrix3 from[5], to[5];
};

const Matrices& matrices() {
    static const Matrices all = [] {
        Matrices m;
        for (const SpaceInfo& s : Spaces) {
            m.from[int(s.space)] = make_rgb_from_xyz(s.space);
            m.to[int(s.space)] = inverse(m.from[int(s.space)]);
        }
        return m;
    }();
    return all;
}

} // namespace

const SpaceInfo& info(Space space) {
    return Spaces[int(space)];
}

std::optional<Space> find_space(std::string_view name) {
    for (const SpaceInfo& s : Spaces)
        if (s.name == name)
            return s.space;
    for (const Alias& a : Aliases)
        if (a.name == name)
            return a.space;
    return std::nullopt;
}

std::string space_names(bool scene_linear) {
    std::string names;
    for (const SpaceInfo& s : Spaces)
        if (s.scene_linear || !scene_linear)
            names += (names.empty() ? "" : ", ") + std::string(s.name);
    return names;
}

Vector3 white_xyz(Space space) {
    const Table& light = white_illuminant(space);
    const Table* curves[3] = {&cie_x(), &cie_y(), &cie_z()};
    Vector3 xyz{};
    for (int i = 0; i < LambdaCount; i++)
        for (int c = 0; c < 3; c++)
            xyz[c] += double((*curves[c])[i]) * light[i] / cie_y_integral();
    return xyz;
}

const Matrix3& space_from_xyz(Space space) {
    return matrices().from[int(space)];
}

const Matrix3& xyz_from_space(Space space) {
    return matrices().to[int(space)];
}

Matrix3 convert(Space from, Space to) {
    return space_from_xyz(to) * (adaptation(white_xyz(from), white_xyz(to)) * xyz_from_space(from));
}

Rgb transform(const Matrix3& m, const Rgb& rgb) {
    const Vector3 r = m * Vector3{rgb.x, rgb.y, rgb.z};
    return {float(r[0]), float(r[1]), float(r[2])};
}

std::optional<Display> find_display(std::string_view name) {
    if (name == "srgb")
        return Display::Srgb;
    if (name == "rec709")
        return Display::Rec709;
    return std::nullopt;
}

float display_encode(Display display, float linear) {
    return display == Display::Srgb ? srgb_encode(linear)
                                    : std::copysign(std::pow(std::abs(linear), 1 / 2.4f), linear);
}

float display_decode(Display display, float encoded) {
    return display == Display::Srgb ? srgb_decode(encoded)
                                    : std::copysign(std::pow(std::abs(encoded), 2.4f), encoded);
}

// The constants of BT.2020 for 12 bits: the two pieces meet to single precision.
float rec709_camera_encode(float linear) {
    const float a = std::abs(linear);
    const float e = a < 0.018053969f ? 4.5f * a : 1.099296827f * std::pow(a, 0.45f) - 0.099296827f;
    return std::copysign(e, linear);
}

float rec709_camera_decode(float encoded) {
    const float a = std::abs(encoded);
    const float l =
        a < 4.5f * 0.018053969f ? a / 4.5f : std::pow((a + 0.099296827f) / 1.099296827f, 1 / 0.45f);
    return std::copysign(l, encoded);
}

} // namespace kanuka::color
