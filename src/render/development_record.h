// A Development as bytes, for checkpoints.
#pragma once

#include <string>
#include <string_view>

#include "render/develop.h"

namespace kanuka::render {

std::string packed(const Development& how);
// False: they are none, and `how` is anything.
bool unpack(std::string_view bytes, Development& how);

} // namespace kanuka::render
