// Shared libraries of procedurals (RISpec 3.2, 5.9.3, DynamicLoad): they export ConvertParameters, Subdivide
// and Free, and call Ri functions. Those calls are recorded as RIB, which is then read where the Procedural
// stands.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ingest/rib/rib.h"

namespace kanuka::ri {

// `declarations`: name, text, name, text, … that hold in the scene. Throws Error where the library cannot be
// used; what its calls do wrong is in `problems`. Thread safety: none, as all of the interface.
std::string run_library(const std::string& path, const std::string& data, float detail,
                        const std::vector<std::string>& declarations, std::string& problems);

// For RibOptions::procedural: DynamicLoad of a file in the request's folders, NAME or NAME.so.
std::optional<std::string> expand_by_library(const ingest::ProceduralRequest& request);

} // namespace kanuka::ri
