// Surfaces of scenes as arrays, and fewer triangles for them.
#pragma once

#include "python/bindings.h"

namespace kanuka::python {

// traced_surfaces(), decimate().
void bind_surfaces(nb::module_& m);

} // namespace kanuka::python
