// RGB spaces and display encodings. One table; names of options, EXR chromaticities and documentation come
// from it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "color/color.h"
#include "color/matrix3.h"

namespace kanuka::color {

// All are linear. Xyz: Y = 1 is white, no white of its own.
enum class Space { Rec709, Rec2020, AcesCg, Aces2065, Xyz };

struct SpaceInfo {
    Space space;
    std::string_view name, text; // what options say; what it is
    Chromaticities primaries;
    double white[2];   // as the standard has it
    bool scene_linear; // colours of a scene may be given in it: there is an uplift table
};
const SpaceInfo& info(Space space);
std::optional<Space> find_space(std::string_view name); // aliases too: srgb, ap1, ap0, …
std::string space_names(bool scene_linear);             // "rec709, rec2020, acescg, …"

// The light that is white, (1, 1, 1), in the space: D65, or D60 for ACES; Y = 1.
const Table& white_illuminant(Space space);
Vector3 white_xyz(Space space); // of that light, 1931 observer

// Rec.709 and Rec.2020 have the white of our own D65 table, as in color.h. ACES spaces have their standard's
// matrix, behind an adaptation of our D60 (off by 1e-4) to their white.
const Matrix3& space_from_xyz(Space space);
const Matrix3& xyz_from_space(Space space);
// Same colour to the eye adapted to each space's white: white stays white. Xyz counts as having D65's white.
Matrix3 convert(Space from, Space to);
Rgb transform(const Matrix3& m, const Rgb& rgb);

// How linear display light in [0, 1] becomes what a file or a display takes; odd about 0.
enum class Display { Srgb, Rec709 };
std::optional<Display> find_display(std::string_view name);
// Srgb: IEC 61966-2-1. Rec709: the inverse of the reference display's BT.1886, V = L^(1/2.4).
float display_encode(Display display, float linear), display_decode(Display display, float encoded);
// The camera's curve of BT.709-6, item 1.2; for files made with it. A display does not undo it.
float rec709_camera_encode(float linear), rec709_camera_decode(float encoded);

} // namespace kanuka::color
