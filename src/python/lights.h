// Lights of a scene, from Python.
#pragma once

#include "python/bindings.h"

namespace kanuka::python {

// add_light(), add_light_shader().
void bind_lights(nb::class_<Scene>& scene);
// light_kinds(): what add_light() takes, as it is declared.
void bind_light_kinds(nb::module_& m);

} // namespace kanuka::python
