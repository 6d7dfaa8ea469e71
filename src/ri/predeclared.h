// Names of options and attributes that C programs use without declaring them, because the renderers they were
// written for declare them: a type is needed to know how long a value is.
#pragma once

#include <string_view>

namespace kanuka::ri {

// Of a name in a request and its group (Option "limits" has the group "limits"): "uniform float", and so on.
// Empty = there is none.
std::string_view predeclared(std::string_view request, std::string_view group, std::string_view name);
// The same for the name in whatever request and group: for messages.
std::string_view predeclared_elsewhere(std::string_view name);

} // namespace kanuka::ri
