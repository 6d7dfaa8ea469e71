// Reads RIB (ASCII, gzip, archives) into the scene model.
#pragma once

#include "scene/scene.h"
#include <string>

namespace kanuka::ingest {

struct RibOptions {
    std::vector<std::string> archive_path; // searched after the folder of the file that asks
    // The number of a FrameBegin; 0 = the first frame that writes more than depth (shadow-map passes are
    // passed over).
    int frame = 0;
};

// Throws Error where the file cannot be read at all; everything else is reported with file, line, column and
// mend, and reading goes on at the next request. "-" reads standard input.
scene::Scene read_rib(const std::string& path, const RibOptions& options, Journal& journal);
scene::Scene parse_rib(const std::string& text, const std::string& name, const RibOptions& options,
                       Journal& journal);

} // namespace kanuka::ingest
