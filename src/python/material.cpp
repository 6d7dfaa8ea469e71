#include "python/arguments.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/values.h"

namespace kanuka::python {

// A Shader as a value is a co-shader: it comes along under the parameter's name, which is its handle.
static scene::ShaderRef shader(const std::string& name, const nb::dict& values) {
    scene::ShaderRef ref;
    ref.name = name;
    nb::dict plain;
    for (auto [key, value] : values) {
        const std::string declared = argument<std::string>(key, "parameters: a name");
        const std::string parameter_name = declared.substr(declared.rfind(' ') + 1);
        const auto take = [&](nb::handle shader, const std::string& handle) {
            scene::ShaderRef c = argument<scene::ShaderRef>(shader, handle.c_str());
            c.handle = handle;
            ref.coshaders.push_back(std::move(c));
            return handle;
        };
        const bool several = is_sequence_of_objects(value) && nb::isinstance<scene::ShaderRef>(value[0]);
        if (nb::isinstance<scene::ShaderRef>(value)) {
            plain[key] = nb::cast(take(value, parameter_name));
        } else if (several) {
            nb::list handles;
            for (size_t i = 0; i < nb::len(value); i++)
                handles.append(value[i].is_none() ? std::string()
                                                  : take(value[i], parameter_name + std::to_string(i)));
            plain[key] = handles;
        } else {
            plain[key] = value;
        }
    }
    ref.parameters = parameters(plain);
    return ref;
}

// A Shader, or the name of one.
static std::optional<scene::ShaderRef> displacement_of(nb::handle given) {
    if (given.is_none())
        return std::nullopt;
    if (!nb::isinstance<nb::str>(given))
        return argument<std::optional<scene::ShaderRef>>(given, "displacement");
    scene::ShaderRef shader;
    shader.name = nb::cast<std::string>(given);
    return shader;
}

// Splits what belongs to the material itself from the shader's parameters.
static void init_material(Material* self, const std::string& surface, const nb::kwargs& keywords) {
    new (self) Material();
    nb::dict values;
    for (auto [key, value] : keywords) {
        const std::string name = nb::cast<std::string>(key);
        if (name == "color" && (nb::isinstance<nb::str>(value) || nb::isinstance<Spectrum>(value)))
            self->color_spectrum = spectrum_text(value, "color");
        else if (name == "color")
            self->color = rgb(value, "color");
        else if (name == "opacity")
            self->opacity = rgb(value, "opacity");
        else if (name == "displacement" && value.is_none())
            self->displacement.reset();
        else if (name == "displacement")
            self->displacement = displacement_of(value);
        else if (name == "displacement_bound")
            self->displacement_bound = argument<float>(value, "displacement_bound");
        else if (name == "parameters")
            values.update(argument<nb::dict>(value, "parameters"));
        else
            values[key] = value;
    }
    self->surface = shader(surface, values);
}

void bind_material(nb::module_& m) {
    nb::class_<scene::ShaderRef> shader_class(
        m, "Shader",
        "A shader by name with values for its parameters. As a parameter of another shader it is a\n"
        "co-shader, which that one calls: Material('layered', base=Shader('tint', c=(1, 0, 0))); a list of\n"
        "them is an array.");
    define(
        shader_class, "__init__",
        [](scene::ShaderRef* self, const std::string& name, const nb::kwargs& values) {
            new (self) scene::ShaderRef(shader(name, values));
        },
        nb::arg("name"), nb::arg("parameters"),
        nb::sig("def __init__(self, name: str, **parameters: object) -> None"));
    shader_class.def_ro("name", &scene::ShaderRef::name);
    shader_class.def("__repr__", [](const scene::ShaderRef& s) { return "kanuka.Shader('" + s.name + "')"; });

    nb::class_<Material> material(
        m, "Material",
        "A surface shader with its parameters, and optionally a displacement.\n\n"
        "Keywords are parameters of the shader: numbers, texts, colours as three numbers, 4x4\n"
        "matrices. A keyword that is no Python name, or needs a type, goes into `parameters`:\n"
        "Material('marble', parameters={'point center': (0, 1, 0)}).\n"
        "A colour may be a Spectrum, or the text that makes one.\n"
        "`color` and `opacity` are the shader's Cs and Os; `displacement` is a Shader and\n"
        "`displacement_bound` the farthest that it moves a point, in object space.");
    define(material, "__init__", &init_material, nb::arg("surface") = "matte", nb::arg("parameters"),
           nb::sig("def __init__(self, surface: str = 'matte', *, color: Sequence[float] | Spectrum | str "
                   "= (1, 1, 1), "
                   "opacity: Sequence[float] = (1, 1, 1), displacement: Shader | str | None = None, "
                   "displacement_bound: float = 0, parameters: dict[str, object] = {}, **keywords: object) "
                   "-> None"));
    material.def_prop_ro("surface", [](const Material& mat) { return mat.surface.name; });
    material.def("__repr__",
                 [](const Material& mat) { return "kanuka.Material('" + mat.surface.name + "')"; });
}

} // namespace kanuka::python
