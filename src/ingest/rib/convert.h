// RIB to RIB: from any coat to any other, without changing what it says.
#pragma once

#include <string>
#include <vector>

#include "base/error.h"
#include "ingest/rib/output.h"

namespace kanuka::ingest {

struct ConvertOptions {
    bool binary = false;
    Packing packing = Packing::None;
    bool expand_archives = false; // ReadArchive becomes what is in the file, and so does DelayedReadArchive
    std::vector<std::string> archive_path; // as in RibOptions
};

// Throws Error where the input cannot be read or the output not written; requests that cannot be read are
// reported and left out.
void convert_rib(const std::string& from, const std::string& to, const ConvertOptions& options,
                 Journal& journal);
std::string convert_text(const std::string& text, const std::string& name, const ConvertOptions& options,
                         Journal& journal);

} // namespace kanuka::ingest
