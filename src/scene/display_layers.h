// What a Display's mode asks for, by the names of a picture's layers.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace kanuka::scene {

// Before the text of a light path expression.
inline constexpr std::string_view ExpressionPrefix = "lpe:";

// "rgbaz" is rgb, alpha and Z; "Ci,Oi" rgb and alpha; other names, parted by commas, are output variables of
// shaders, whose declarations may stand before them: "color tint" is tint. From "lpe:" on, all is one light
// path expression, which may have commas and blanks itself.
std::vector<std::string> layers_of_mode(std::string_view mode);
// One that every picture has.
bool is_standard_layer(std::string_view name);

} // namespace kanuka::scene
