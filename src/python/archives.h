// RIB archives: what may stand between WorldBegin and WorldEnd, in a file of its own.
#pragma once

#include "ingest/rib/rib.h"

namespace kanuka::python {

// A world that holds an archive and nothing else.
scene::Scene read_archive(const std::string& path, const ingest::RibOptions& options, Journal& journal);

} // namespace kanuka::python
