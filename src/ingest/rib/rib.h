// Reads RIB (ASCII, gzip, archives) into the scene model.
#pragma once

#include "scene/scene.h"
#include <string>

namespace kanuka::ingest {

struct RibOptions {
    std::vector<std::string> archive_path; // searched after the folder of the file that asks
    int frame = 0;                         // which FrameBegin block; 0 = the first
};

// Throws Error where the file cannot be read at all; everything else is reported with file, line, column and
// mend, and reading goes on at the next request. "-" reads standard input.
scene::Scene read_rib(const std::string& path, const RibOptions& options, Journal& journal);
scene::Scene parse_rib(const std::string& text, const std::string& name, const RibOptions& options,
                       Journal& journal);

} // namespace kanuka::ingest
