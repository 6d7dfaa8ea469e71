#include <filesystem>
#include <fstream>
#include <sstream>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/messages.h"
#include "python/shader.h"

namespace kanuka::python {

namespace {

using Texts = std::vector<std::string>;

nb::object default_value(const sl::Parameter& p) {
    if (p.type >= sl::Type::String) {
        if (p.strings.empty())
            return nb::none();
        return p.array_size || p.resizable ? nb::cast(p.strings) : nb::cast(p.strings[0]);
    }
    if (p.floats.empty())
        return nb::none();
    return p.floats.size() == 1 && !p.array_size && !p.resizable ? nb::cast(p.floats[0]) : nb::cast(p.floats);
}

nb::list parameters(const ShaderInfo& s) {
    nb::list list;
    for (const sl::Parameter& p : s.shader->parameters()) {
        nb::dict entry;
        entry["name"] = p.name;
        entry["type"] = std::string(sl::type_name(p.type));
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

nb::list textures(const ShaderInfo& s) {
    nb::list list;
    for (const sl::TextureUse& t : s.shader->textures()) {
        nb::dict entry;
        entry["file"] = t.file;
        entry["parameter"] = t.parameter;
        entry["environment"] = t.environment;
        list.append(entry);
    }
    return list;
}

// The text of a shader, given or in its file.
std::string read_source(const std::filesystem::path& path, const std::optional<std::string>& given) {
    if (given)
        return *given;
    std::ifstream in(path, std::ios::binary);
    std::error_code ec;
    if (!in || std::filesystem::is_directory(path, ec))
        throw Error({path.string()}, "cannot read the shader");
    std::ostringstream text;
    text << in.rdbuf();
    return std::move(text).str();
}

// What compiling, publishing and showing take alike.
struct Request {
    std::filesystem::path path;
    sl::CompileOptions options;
    Messages messages;
    std::string text;

    Request(const std::filesystem::path& path, const std::optional<std::string>& source, const Texts& include,
            const std::map<std::string, std::string>& defines, std::shared_ptr<Journal> journal)
        : path(path), messages(std::move(journal)), text(read_source(path, source)) {
        options.include_path = include;
        options.defines.assign(defines.begin(), defines.end());
    }
    [[noreturn]] void fail() const {
        for (const Journal::Entry& e : messages.journal->entries())
            if (e.severity == Severity::Error) {
                messages.tell(e.message);
                throw Error(e.where, e.message);
            }
        throw Error({path.string()}, "the shader does not compile");
    }
};

using CoShaders = std::map<std::string, std::filesystem::path>;
using Connections = std::map<std::string, Texts>;

// Connections are by parameter, those of co-shaders "handle.parameter". Of a category: what the file says.
void connect(sl::CompileOptions& options, const CoShaders& coshaders, const Connections& connections) {
    std::vector<sl::CoShader> all;
    for (const auto& [handle, file] : coshaders) {
        sl::CoShader c;
        c.handle = handle;
        c.file = file.string();
        c.text = read_source(file, std::nullopt);
        Journal journal; // what is wrong with it is told when it is compiled with the shader
        if (const auto alone = sl::compile_source(c.file, c.text, options, journal))
            for (const sl::Parameter& p : alone->parameters())
                if (p.name == "__category" && !p.strings.empty())
                    c.category = p.strings[0];
        all.push_back(std::move(c));
    }
    options.coshaders = std::move(all);
    for (const auto& [parameter, handles] : connections) {
        std::vector<sl::Connection>* to = &options.connections;
        std::string name = parameter;
        if (const size_t dot = parameter.rfind('.'); dot != std::string::npos)
            for (sl::CoShader& c : options.coshaders)
                if (c.handle == parameter.substr(0, dot)) {
                    to = &c.connections;
                    name = parameter.substr(dot + 1);
                }
        to->push_back({name, handles});
    }
}

ShaderInfo compile(const std::filesystem::path& path, const std::optional<std::string>& source,
                   const Texts& include, const std::map<std::string, std::string>& defines, int lanes,
                   int opt_level, bool use_cache, const std::string& cache, bool strict_directions,
                   int array_room, const CoShaders& coshaders, const Connections& connections,
                   std::shared_ptr<Journal> journal) {
    Request r(path, source, include, defines, std::move(journal));
    r.options.strict_directions = strict_directions;
    r.options.array_room = array_room;
    connect(r.options, coshaders, connections);
    r.options.lanes = lanes;
    r.options.opt_level = opt_level;
    r.options.use_cache = use_cache;
    r.options.cache_dir = cache;
    ShaderInfo info;
    info.file = path.string();
    {
        nb::gil_scoped_release free;
        info.shader = sl::compile_source(info.file, r.text, r.options, *r.messages.journal);
    }
    if (!info.shader)
        r.fail();
    r.messages.tell();
    return info;
}

nb::bytes publish(const std::filesystem::path& path, const std::optional<std::string>& source,
                  const Texts& include, const std::map<std::string, std::string>& defines,
                  std::shared_ptr<Journal> journal) {
    Request r(path, source, include, defines, std::move(journal));
    std::optional<std::string> bytes;
    {
        nb::gil_scoped_release free;
        bytes = sl::publish(path.string(), r.text, r.options, *r.messages.journal);
    }
    if (!bytes)
        r.fail();
    r.messages.tell();
    return nb::bytes(bytes->data(), bytes->size());
}

std::string emit(const std::filesystem::path& path, const std::string& what, const std::string& stage,
                 const std::optional<std::string>& source, const Texts& include,
                 const std::map<std::string, std::string>& defines, int lanes, int opt_level,
                 std::shared_ptr<Journal> journal) {
    const auto* const found = std::find(std::begin(sl::EmitNames), std::end(sl::EmitNames), what);
    if (found == std::end(sl::EmitNames))
        throw nb::value_error("expected rsl, ast, ir, c, llvm or asm");
    const Texts stages = sl::emit_stages();
    if (!stage.empty() && std::find(stages.begin(), stages.end(), stage) == stages.end())
        throw nb::value_error("there is no such stage; shader_stages() names them");
    Request r(path, source, include, defines, std::move(journal));
    r.options.lanes = lanes;
    r.options.opt_level = opt_level;
    std::optional<std::string> text;
    {
        nb::gil_scoped_release free;
        text = sl::emit(path.string(), r.text, sl::Emit(found - sl::EmitNames), stage, r.options,
                        *r.messages.journal);
    }
    if (!text)
        r.fail();
    r.messages.tell();
    return *text;
}

// ---- the cache

std::string folder_or_default(const std::string& folder) {
    return folder.empty() ? sl::default_cache_dir() : folder;
}

nb::list cache_entries(const std::string& folder, bool verify) {
    nb::list list;
    for (const sl::CacheEntry& e : sl::cache_entries(folder_or_default(folder), verify)) {
        nb::dict entry;
        entry["file"] = e.file;
        entry["shader"] = e.shader;
        entry["key"] = e.key;
        entry["bytes"] = e.bytes;
        entry["age_s"] = e.age_s;
        entry["problem"] = e.problem;
        list.append(entry);
    }
    return list;
}

void bind_cache(nb::module_& m) {
    define(m, "shader_cache_folder", &sl::default_cache_dir,
           "Where compiled shaders are kept: KANUKA_SHADER_CACHE, or the user's cache folder.");
    define(m, "shader_cache_limit", &sl::cache_limit,
           "Its largest size in bytes: KANUKA_SHADER_CACHE_SIZE, or 1 GiB.");
    define(m, "shader_cache_entries", &cache_entries, nb::arg("folder") = "", nb::kw_only(),
           nb::arg("verify") = false,
           "What is in the shader cache, newest first; with `verify`, what is wrong with each entry.",
           nb::sig("def shader_cache_entries(folder: str = '', *, verify: bool = False) -> list[dict[str, "
                   "object]]"));
    define(
        m, "shader_cache_clear",
        [](const std::string& folder) { return sl::cache_clear(folder_or_default(folder)); },
        nb::arg("folder") = "", "Empties the shader cache; returns the number of files removed.");
    define(
        m, "shader_cache_trim",
        [](const std::string& folder, std::optional<uint64_t> bytes) {
            return sl::cache_trim(folder_or_default(folder), bytes.value_or(sl::cache_limit()));
        },
        nb::arg("folder") = "", nb::arg("bytes") = nb::none(),
        "Removes the entries not used for longest until the cache is below the size; returns the number of "
        "files removed.");
}

} // namespace

void bind_shader(nb::module_& m) {
    auto shader =
        nb::class_<ShaderInfo>(m, "CompiledShader", "A shader that compiled: its name, kind and parameters.")
            .def_prop_ro("name", [](const ShaderInfo& s) { return s.shader->name(); })
            .def_prop_ro("kind",
                         [](const ShaderInfo& s) { return std::string(sl::kind_name(s.shader->kind())); })
            .def_prop_ro("from_cache", [](const ShaderInfo& s) { return s.shader->from_cache(); })
            .def_prop_ro("parameters", &parameters,
                         nb::sig("def parameters(self) -> list[dict[str, object]]"))
            .def_prop_ro("textures", &textures, nb::sig("def textures(self) -> list[dict[str, object]]"))
            .def_prop_ro(
                "stages", [](const ShaderInfo& s) { return s.shader->stages(); },
                nb::sig("def stages(self) -> list[str]"));
    bind_shader_run(shader);
    define(
        m, "compile_shader", &compile, nb::arg("path"), nb::kw_only(), nb::arg("source") = nb::none(),
        nb::arg("include") = nb::list(), nb::arg("defines") = nb::dict(), nb::arg("lanes") = 0,
        nb::arg("opt_level") = 2, nb::arg("use_cache") = true, nb::arg("cache") = "",
        nb::arg("strict_directions") = false, nb::arg("array_room") = sl::CompileOptions{}.array_room,
        nb::arg("coshaders") = nb::dict(), nb::arg("connections") = nb::dict(),
        nb::arg("journal") = nb::none(),
        "Compiles a shader as a render would; `source` stands for the file's text. Raises kanuka.Error with "
        "the first error; the others are warnings, or all go to `journal`.\n"
        "`coshaders` are files by handle; `connections` handles by parameter, which of a co-shader is "
        "'handle.parameter'.",
        nb::sig(
            "def compile_shader(path: str | os.PathLike, *, source: str | None = None, "
            "include: Sequence[str] = [], defines: dict[str, str] = {}, lanes: int = 0, opt_level: int = 2, "
            "use_cache: bool = True, cache: str = '', strict_directions: bool = False, array_room: int = 64, "
            "coshaders: dict[str, str | os.PathLike] = {}, connections: dict[str, Sequence[str]] = {}, "
            "journal: Journal | None = None) -> CompiledShader"));
    define(m, "publish_shader", &publish, nb::arg("path"), nb::kw_only(), nb::arg("source") = nb::none(),
           nb::arg("include") = nb::list(), nb::arg("defines") = nb::dict(), nb::arg("journal") = nb::none(),
           "The bytes of a .slo: a shader that needs none of its files any more.",
           nb::sig("def publish_shader(path: str | os.PathLike, *, source: str | None = None, "
                   "include: Sequence[str] = [], defines: dict[str, str] = {}, journal: Journal | None = "
                   "None) -> bytes"));
    define(
        m, "published_metadata",
        [](const std::filesystem::path& path) {
            return sl::published_metadata(path.string(), read_source(path, std::nullopt));
        },
        nb::arg("path"), "What a .slo says of itself, as JSON text, without compiling it.",
        nb::sig("def published_metadata(path: str | os.PathLike) -> str"));
    define(
        m, "emit_shader", &emit, nb::arg("path"), nb::arg("what"), nb::arg("stage") = "", nb::kw_only(),
        nb::arg("source") = nb::none(), nb::arg("include") = nb::list(), nb::arg("defines") = nb::dict(),
        nb::arg("lanes") = 0, nb::arg("opt_level") = 2, nb::arg("journal") = nb::none(),
        "What becomes of a shader, as text: rsl (preprocessed), ast, ir, c, llvm or asm.",
        nb::sig(
            "def emit_shader(path: str | os.PathLike, what: str, stage: str = '', *, source: str | None = "
            "None, "
            "include: Sequence[str] = [], defines: dict[str, str] = {}, lanes: int = 0, opt_level: int = 2, "
            "journal: Journal | None = None) -> str"));
    define(m, "shader_stages", &sl::emit_stages, "The stages that emit_shader() may be asked for.");
    bind_cache(m);
}

} // namespace kanuka::python
