#include <cmath>
#include <filesystem>

#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "color/difference.h"
#include "color/illuminants.h"
#include "color/materials.h"
#include "color/photometry.h"
#include "color/sensor.h"
#include "python/arguments.h"

namespace kanuka::python {

namespace {

using Numbers = std::vector<double>;

Spectrum from_values(Numbers wavelengths, Numbers values) {
    if (wavelengths.size() != values.size())
        throw nb::value_error("values: expected one for each wavelength");
    std::string text = "nm:";
    for (size_t i = 0; i < values.size(); i++) {
        char pair[64];
        std::snprintf(pair, sizeof pair, "%s %.9g %.9g", i ? "," : "", wavelengths[i], values[i]);
        text += pair;
    }
    return {text, color::resolve_spectrum(text, {}).table};
}

nb::object array_of(const color::Table& table) {
    auto data = std::make_unique<float[]>(table.size());
    std::copy(table.begin(), table.end(), data.get());
    float* raw = data.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<float*>(p); });
    const size_t shape[] = {table.size()};
    return nb::ndarray<nb::numpy, float>(raw, 1, shape, owner).cast();
}

color::Table seen(const Spectrum& s, const Spectrum* under) {
    color::Table t = s.table;
    if (under)
        for (int i = 0; i < color::LambdaCount; i++)
            t[i] *= under->table[i];
    return t;
}

std::tuple<double, double, double> xyz(const Spectrum& s, const Spectrum* under,
                                       const std::string& observer) {
    const auto o = color::find_observer(observer);
    if (!o)
        throw nb::value_error("observer: expected \"1931\" or \"1964\"");
    const color::Table& white = under ? under->table : color::find_illuminant("E").value();
    const Rgb v = color::make_sensor(*o, white, color::Space::Xyz).see(seen(s, under));
    return {v.x, v.y, v.z};
}

color::Space space_of(const std::string& name) {
    const auto space = color::find_space(name);
    if (!space)
        throw nb::value_error(("space: \"" + name + "\" is not one of " + color::space_names(false)).c_str());
    return *space;
}

} // namespace

std::string spectrum_text(nb::handle value, const char* name) {
    if (nb::isinstance<Spectrum>(value))
        return nb::cast<const Spectrum&>(value).text;
    if (!nb::isinstance<nb::str>(value))
        wrong_argument(name, "Spectrum | str", value);
    return nb::cast<std::string>(value);
}

static void bind_class(nb::module_& m) {
    nb::class_<Spectrum> spectrum(
        m, "Spectrum",
        "A spectrum over 360 to 830 nm: a light by name ('D65', 'F11', 'LED-B3', "
        "'blackbody:3200'), a file, or\n"
        "values at wavelengths in nm, linear between them. Lights by name have Y = 1. It "
        "stands for a colour in\n"
        "Material and add_light(): what is measured is rendered as it was measured.");
    define(
        spectrum, "__init__",
        [](Spectrum* self, const std::string& name) {
            new (self) Spectrum();
            const color::NamedSpectrum found = color::resolve_spectrum(name, {});
            self->table = found.table;
            self->text = found.file.empty() ? name : std::filesystem::absolute(found.file).string();
        },
        nb::arg("name"));
    define(
        spectrum, "__init__",
        [](Spectrum* self, Numbers wavelengths, Numbers values) {
            new (self) Spectrum(from_values(std::move(wavelengths), std::move(values)));
        },
        nb::arg("wavelengths"), nb::arg("values"));
    spectrum.def_prop_ro(
        "values", [](const Spectrum& s) { return array_of(s.table); }, "at 360, 361, … 830 nm",
        nb::sig("def values(self) -> numpy.typing.NDArray[numpy.float32]"));
    define(spectrum, "xyz", &xyz, nb::arg("under").none() = nb::none(), nb::kw_only(),
           nb::arg("observer") = "1931",
           "Tristimulus values, of a reflectance `under` a light or of a light by itself.");
    define(
        spectrum, "rgb",
        [](const Spectrum& s, const Spectrum* under, const std::string& space) {
            const Rgb v = color::transform(color::space_from_xyz(space_of(space)), [&] {
                const auto [x, y, z] = xyz(s, under, "1931");
                return Rgb(float(x), float(y), float(z));
            }());
            return std::tuple(v.x, v.y, v.z);
        },
        nb::arg("under").none() = nb::none(), nb::kw_only(), nb::arg("space") = "rec709",
        "Linear RGB of it, not adapted.");
    spectrum.def_prop_ro(
        "chromaticity",
        [](const Spectrum& s) {
            const auto c = color::chromaticity(s.table);
            return std::pair(c.x, c.y);
        },
        "x, y for the 1931 observer");
    spectrum.def_prop_ro(
        "efficacy", [](const Spectrum& s) { return color::luminous_efficacy(s.table); }, "lumen per watt");
    spectrum.def("__str__", [](const Spectrum& s) { return s.text; });
    spectrum.def("__repr__",
                 [](const Spectrum& s) { return "kanuka.Spectrum('" + s.text.substr(0, 40) + "')"; });
}

// Lights, metals and glasses by name, and differences of colours.
static void bind_tables(nb::module_& m) {
    m.def("illuminant_names", &color::illuminant_names, "Lights that Spectrum takes by name.");
    define(
        m, "metal",
        [](const std::string& name) {
            const auto metal = color::find_metal(name);
            if (!metal) {
                std::string names;
                for (const std::string& n : color::metal_names())
                    names += " " + n;
                throw nb::key_error(("no metal \"" + name + "\"; there are" + names).c_str());
            }
            return nb::make_tuple(array_of(metal->eta), array_of(metal->k));
        },
        nb::arg("name"), "Complex refractive index of a metal: n and k at 360, 361, … 830 nm.");
    define(
        m, "glass",
        [](const std::string& name) {
            const auto glass = color::find_glass(name);
            if (!glass) {
                std::string names;
                for (const std::string& n : color::glass_names())
                    names += " " + n;
                throw nb::key_error(("no glass \"" + name + "\"; there are" + names).c_str());
            }
            return array_of(glass->table());
        },
        nb::arg("name"), "Refractive index of a glass at 360, 361, … 830 nm.");
    define(
        m, "delta_e_2000",
        [](std::array<double, 3> a, std::array<double, 3> b, std::array<double, 3> white) {
            return color::delta_e_2000(color::lab_from_xyz(a, white), color::lab_from_xyz(b, white));
        },
        nb::arg("a"), nb::arg("b"), nb::arg("white"), "CIEDE2000 between two XYZ under a white.");
}

void bind_spectrum(nb::module_& m) {
    bind_class(m);
    bind_tables(m);
}

} // namespace kanuka::python
