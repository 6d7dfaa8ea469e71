// Files of other renderers that have the names of what is looked for here.
#pragma once

#include <string>

namespace kanuka::shade {

// Is it a published shader of ours? ".slo" is what other renderers call their compiled shaders, too.
bool is_published_shader(const std::string& path);

// What a file is that cannot be read as a picture, and what to do about it, for messages: "is …".
std::string foreign_picture(const std::string& path);

} // namespace kanuka::shade
