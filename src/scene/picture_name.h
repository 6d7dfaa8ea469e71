// The file that a Display's name stands for.
#pragma once

#include <string>
#include <string_view>

namespace kanuka::scene {

// ".tif" and others that name a kind of picture, with the dot; in any case.
bool is_picture_suffix(std::string_view suffix);

// "ball.tif" is ball.exr; other names keep what follows their last dot, which may be a frame's number or a
// cube's face: "anim.0001" is anim.0001.exr, "env.xp" env.xp.exr.
std::string picture_file(std::string_view name);

} // namespace kanuka::scene
