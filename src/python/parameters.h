// Declared parameters (scene/schema) as Python has them: properties, keyword arguments, and what
// kanuka.option_parameters() tells.
#pragma once

#include "python/arguments.h"
#include "scene/schema/parameter.h"

namespace kanuka::python {

// "int", "tuple[float, float]", "Sequence[str]"; what is read back has lists for sequences.
std::string annotation(const scene::ParameterInfo& parameter, bool read_back);
// TypeError where it is of another type, ValueError where the parameter refuses it. Names it as `name`.
scene::Setting setting(const scene::ParameterInfo& parameter, nb::handle value, const char* name);
nb::object object_of(const scene::ParameterInfo& parameter, const scene::Setting& setting);
// What it is, as the manual and the command line need it.
nb::dict description(const scene::ParameterInfo& parameter, const scene::Setting& fallback);

// `look` gives what the rows read of an owner, `put` sets a row by its name.
template <class Owner, class Of, class Look, class Put>
void bind_parameters(nb::class_<Owner>& owner, std::span<const scene::Parameter<Of>> rows, Look look,
                     Put put) {
    for (const scene::Parameter<Of>& row : rows) {
        const std::string name = row.name, unit = *row.unit ? std::string(row.unit) + "; " : "";
        owner.def_prop_rw(
            row.name, [&row, look](const Owner& of) { return object_of(row, row.get(look(of))); },
            [&row, put](Owner& of, Given<nb::object> value) {
                put(of, row.name, setting(row, value.value, row.name));
            },
            (unit + row.about).c_str(),
            nb::for_getter(nb::sig(("def " + name + "(self) -> " + annotation(row, true)).c_str())),
            nb::for_setter(nb::arg("value").none()),
            nb::for_setter(nb::sig(
                ("def " + name + "(self, value: " + annotation(row, false) + ", /) -> None").c_str())));
    }
}

} // namespace kanuka::python
