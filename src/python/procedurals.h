// Procedural plug-ins written in Python.
#pragma once

#include "ingest/rib/rib.h"
#include "python/bindings.h"

namespace kanuka::python {

// Asks functions by name, then those that ship (kanuka.procedurals).
std::function<std::optional<std::string>(const ingest::ProceduralRequest&)> plug_ins(nb::dict procedurals);

} // namespace kanuka::python
