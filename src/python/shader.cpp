#include <filesystem>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/vector.h>

#include "python/bindings.h"
#include "sl/sl.h"

namespace kanuka::python {

namespace {

const char* name(sl::Type type) {
    constexpr const char* names[] = {"float", "color", "point", "vector", "normal", "matrix", "string"};
    return names[int(type)];
}

const char* name(sl::ShaderKind kind) {
    constexpr const char* names[] = {"class", "surface", "displacement", "light", "volume", "imager"};
    return names[int(kind)];
}

nb::object default_value(const sl::Parameter& p) {
    if (p.type == sl::Type::String) {
        if (p.strings.empty())
            return nb::none();
        return p.array_size || p.resizable ? nb::cast(p.strings) : nb::cast(p.strings[0]);
    }
    if (p.floats.empty())
        return nb::none();
    return p.floats.size() == 1 && !p.array_size && !p.resizable ? nb::cast(p.floats[0]) : nb::cast(p.floats);
}

// A compiled shader for those who only want to know it; Material names shaders by themselves.
struct ShaderInfo {
    std::shared_ptr<const sl::Shader> shader;
    nb::list parameters() const {
        nb::list list;
        for (const sl::Parameter& p : shader->parameters()) {
            nb::dict entry;
            entry["name"] = p.name;
            entry["type"] = name(p.type);
            entry["array_size"] = p.array_size;
            entry["resizable"] = p.resizable;
            entry["varying"] = p.varying;
            entry["output"] = p.output;
            entry["default"] = default_value(p);
            entry["doc"] = p.doc;
            list.append(entry);
        }
        return list;
    }
};

} // namespace

void bind_shader(nb::module_& m) {
    nb::class_<ShaderInfo>(m, "CompiledShader", "A shader that compiled: its name, kind and parameters.")
        .def_prop_ro("name", [](const ShaderInfo& s) { return s.shader->name(); })
        .def_prop_ro("kind", [](const ShaderInfo& s) { return name(s.shader->kind()); })
        .def_prop_ro("from_cache", [](const ShaderInfo& s) { return s.shader->from_cache(); })
        .def_prop_ro("parameters", &ShaderInfo::parameters,
                     nb::sig("def parameters(self) -> list[dict[str, object]]"));
    m.def(
        "compile_shader",
        [](const std::filesystem::path& path, const std::vector<std::string>& include,
           const std::map<std::string, std::string>& defines, int lanes, int opt_level, bool use_cache,
           std::shared_ptr<Journal> journal) {
            sl::CompileOptions options;
            options.lanes = lanes;
            options.opt_level = opt_level;
            options.include_path = include;
            options.defines.assign(defines.begin(), defines.end());
            options.use_cache = use_cache;
            if (!journal)
                journal = std::make_shared<Journal>();
            ShaderInfo info;
            {
                nb::gil_scoped_release free;
                info.shader = sl::compile_file(path.string(), options, *journal);
            }
            if (!info.shader) {
                for (const Journal::Entry& e : journal->entries())
                    if (e.severity == Severity::Error)
                        throw Error(e.where, e.message);
                throw Error({path.string()}, "the shader does not compile");
            }
            return info;
        },
        nb::arg("path"), nb::kw_only(), nb::arg("include") = nb::list(), nb::arg("defines") = nb::dict(),
        nb::arg("lanes") = 0, nb::arg("opt_level") = 2, nb::arg("use_cache") = true,
        nb::arg("journal") = nb::none(),
        "Compiles a shader as a render would. Raises kanuka.Error with the first error; all of them go to "
        "`journal`.",
        nb::sig("def compile_shader(path: str | os.PathLike, *, include: Sequence[str] = [], "
                "defines: dict[str, str] = {}, lanes: int = 0, opt_level: int = 2, use_cache: bool = True, "
                "journal: Journal | None = None) -> CompiledShader"));
}

} // namespace kanuka::python
