// The functions of this program that compiled shaders may call.
#pragma once

#include <string_view>

namespace kanuka::sl {

void* host_symbol(std::string_view name); // null = there is none

} // namespace kanuka::sl
