// Which build of Kanuka this is, by its code: what another one has made may differ in the last bits.
#pragma once

#include <string>

namespace kanuka {

// The linker's build id of the library or program that this is in, in hexadecimal digits; "none" where there
// is none.
const std::string& build_id();

} // namespace kanuka
