// Shaders of the scene: found, compiled, connected to their co-shaders, and bound to their values.
#include <filesystem>

#include "shade/foreign.h"
#include "shade/system_impl.h"

namespace kanuka::shade {

namespace {

constexpr const char* ShaderExtensions[] = {".slo", ".sl"};
constexpr const char* AsNamed[] = {""};

} // namespace

void SystemImpl::note_names(const std::vector<scene::Primitive>& primitives) {
    const scene::Attributes* last = nullptr; // neighbours nearly always share them
    for (const scene::Primitive& p : primitives) {
        if (!p.attributes || p.attributes.get() == last)
            continue;
        last = p.attributes.get();
        for (const auto* ref : {&last->surface, &last->displacement, &last->atmosphere})
            if (*ref)
                m_first_named.try_emplace((*ref)->name, (*ref)->where);
    }
}

std::optional<std::string> SystemImpl::find(const scene::ShaderRef& ref) const {
    const std::string extension = std::filesystem::path(ref.name).extension().string();
    const auto ours = [this](const std::string& path) {
        if (!path.ends_with(".slo") || is_published_shader(path))
            return true;
        std::lock_guard lock(m_foreign_mutex);
        if (m_foreign.insert(path).second)
            m_journal.report(Severity::Info, Location{path},
                             "was compiled by another renderer and is passed over; its source, NAME.sl, is "
                             "what serves here");
        return false;
    };
    std::optional<std::string> path;
    if (extension == ".sl" || extension == ".slo")
        path = find_file(ref.name, m_shader_folders, AsNamed, ours);
    return path ? path : find_file(ref.name, m_shader_folders, ShaderExtensions, ours);
}

std::string SystemImpl::not_found(const scene::ShaderRef& ref, const Location& asker) const {
    std::string foreign; // as find() left them
    {
        std::lock_guard lock(m_foreign_mutex);
        for (const std::string& path : m_foreign)
            if (std::filesystem::path(path).stem() == std::filesystem::path(ref.name).stem())
                foreign = path;
    }
    return "shader \"" + ref.name + "\" is not found (" + ref.name + ".slo or " + ref.name + ".sl)" +
           did_you_mean(ref.name, m_shader_folders, ShaderExtensions) + "; " +
           searched_in(m_shader_folders, "shader", asker) +
           (foreign.empty()
                ? ""
                : ". There is " + foreign + ", which another renderer compiled: its source is needed");
}

// Once for each key.
SystemImpl::Loaded SystemImpl::compile(const std::string& key, const std::string& path,
                                       const sl::CompileOptions& options) {
    std::promise<Loaded> promise;
    std::shared_future<Loaded> future;
    bool mine = false;
    {
        std::lock_guard lock(m_mutex);
        const auto [place, fresh] = m_shaders.try_emplace(key);
        if (fresh)
            place->second = promise.get_future().share();
        mine = fresh;
        future = place->second;
    }
    if (mine) {
        Loaded compiled;
        try {
            compiled = m_compile(path, options, m_journal);
        } catch (const std::exception& e) {
            m_journal.error(Location{path}, e.what());
        }
        promise.set_value(compiled);
    }
    return future.get();
}

SystemImpl::Loaded SystemImpl::load(const scene::ShaderRef& ref, sl::ShaderKind wanted, bool area_light) {
    const std::string instead = wanted == sl::ShaderKind::Displacement ? "The surface is not displaced"
                                : wanted == sl::ShaderKind::Light      ? "The light is left out"
                                : wanted == sl::ShaderKind::Imager     ? "The picture stays as it is"
                                : wanted == sl::ShaderKind::Volume     ? "The air stays clear"
                                                                       : "Matte stands in for it";
    const std::optional<std::string> path = find(ref);
    if (!path) {
        const auto first = m_first_named.find(ref.name);
        const Location& asker = first == m_first_named.end() ? ref.where : first->second;
        m_journal.error(asker, not_found(ref, asker) + ". " + instead);
        return nullptr;
    }
    sl::CompileOptions options = m_compile_options;
    options.area_light = area_light;
    if (wanted == sl::ShaderKind::Volume) // as many segments at a time as ever, whatever lanes paths have
        options.lanes = 0;
    Loaded shader = compile(area_light ? *path + " on an area" : *path, *path, options);
    if (shader && m_gathers_light && shader->has_light_of_its_own()) {
        options.gathers_light = true;
        shader = compile(*path + " gathers light", *path, options);
    }
    if (!shader) {
        m_journal.error(ref.where, "shader \"" + ref.name + "\" (" + *path +
                                       ") does not compile; mend it as its messages say. " + instead);
        return nullptr;
    }
    const sl::ShaderKind kind = shader->kind();
    if (kind == wanted || (kind == sl::ShaderKind::Class &&
                           (wanted == sl::ShaderKind::Surface || wanted == sl::ShaderKind::Displacement)))
        return shader;
    m_journal.error(ref.where, "\"" + ref.name + "\" (" + *path + ") is a " +
                                   std::string(sl::kind_name(kind)) + " shader, where a " +
                                   std::string(sl::kind_name(wanted)) + " shader is called for. " + instead);
    return nullptr;
}

std::optional<CoShader> SystemImpl::load_coshader(const scene::ShaderRef& ref) {
    // Of a Shader, a layer or a Pattern.
    const std::string instead =
        "Its handle \"" + ref.handle + "\" is null, and what it feeds keeps its default";
    const std::optional<std::string> path = find(ref);
    if (!path) {
        m_journal.error(ref.where, not_found(ref, ref.where) + ". " + instead);
        return std::nullopt;
    }
    CoShader found{&ref, compile(*path, *path, m_compile_options), *path, {}, {}, {}};
    if (!found.shader) {
        m_journal.error(ref.where, "shader \"" + ref.name + "\" (" + *path +
                                       ") does not compile; mend it as its messages say. " + instead);
        return std::nullopt;
    }
    return found;
}

// A shader that calls co-shaders is compiled once more, together with those that it reaches.
void SystemImpl::connect(Bound& bound, const scene::ShaderRef& ref, const Scope& scope,
                         const scene::ValueList& primvars, const Spaces& spaces, bool area_light) {
    const bool layered = ref.parameters.find(":layers") != nullptr;
    if (!bound.shader || (bound.shader->coshaders() == sl::CoShaderUse::None && !layered))
        return;
    const Network network = connect_coshaders(
        *bound.shader, ref, scope, [this](const scene::ShaderRef& r) { return load_coshader(r); }, m_journal);
    if (network.coshaders.empty())
        return;
    const std::optional<std::string> path = find(ref);
    sl::CompileOptions options = m_compile_options;
    options.area_light = area_light;
    const std::string key = *path + (area_light ? " on an area" : "") + describe(network, options);
    Loaded linked = compile(key, *path, options);
    if (!linked) {
        m_journal.error(ref.where, "shader \"" + ref.name +
                                       "\" does not compile with the co-shaders that it is "
                                       "connected to; mend it as the messages say. It runs without them");
        return;
    }
    bound.shader = std::move(linked);
    for (const CoShader& c : network.coshaders) {
        Spaces own = spaces;
        own.current_from_shader = spaces.current_from_world * c.ref->world_from_shader;
        for (sl::Argument& a :
             bind_arguments(*c.shader, with_measured_colors(*c.ref, *c.shader), primvars, own, m_journal)) {
            a.name = c.handle + "." + a.name;
            bound.arguments.push_back(std::move(a));
        }
    }
}

// A colour that is given as a text is a spectrum: the RGB that stands for it in the palette.
scene::ShaderRef SystemImpl::with_measured_colors(const scene::ShaderRef& ref, const sl::Shader& shader) {
    scene::ShaderRef result = ref;
    if (!m_palette)
        return result;
    for (scene::Value& v : result.parameters.values) {
        if (v.type != scene::Type::String || v.strings.empty())
            continue;
        for (const sl::Parameter& p : shader.parameters())
            if (p.name == v.name && p.type == sl::Type::Color && p.array_size <= 0) {
                const Rgb rgb =
                    measured_color(v.strings[0], Rgb(0.5f), v.where.line > 0 ? v.where : ref.where);
                v.type = scene::Type::Color;
                v.floats = std::vector<float>{rgb.x, rgb.y, rgb.z};
            }
    }
    return result;
}

Rgb SystemImpl::measured_color(const std::string& name, const Rgb& instead, const Location& where) {
    try {
        return m_palette->add_named(name, m_textures.folders());
    } catch (const Error& e) {
        m_journal.error(where, std::string(e.what()) + ". The plain colour stands in for it");
        return instead;
    }
}

Bound SystemImpl::bind(const std::optional<scene::ShaderRef>& ref, sl::ShaderKind wanted,
                       const scene::Primitive& primitive, const Spaces& spaces) {
    Bound bound;
    bound.where = ref ? ref->where : primitive.where;
    if (!ref)
        return bound;
    bound.shader = load(*ref, wanted, wanted == sl::ShaderKind::Light);
    if (bound.shader)
        bound.arguments = bind_arguments(*bound.shader, with_measured_colors(*ref, *bound.shader),
                                         primitive.primvars, spaces, m_journal);
    Scope scope = {&ref->coshaders};
    if (primitive.attributes)
        scope.push_back(&primitive.attributes->coshaders);
    connect(bound, *ref, scope, primitive.primvars, spaces, wanted == sl::ShaderKind::Light);
    return bound;
}

bool SystemImpl::surface_reads(const scene::Primitive& primitive, std::string_view name) {
    if (name == "Cs" || name == "Os") // the colour, which is no parameter
        return true;
    const scene::Attributes* attributes = primitive.attributes.get();
    const auto& ref = attributes && (attributes->surface || attributes->area_light) ? attributes->surface
                                                                                    : m_default_surface;
    const Loaded shader = ref ? load(*ref, sl::ShaderKind::Surface) : nullptr;
    if (!shader)
        return false;
    const auto has = [&](const sl::Shader& of) {
        return std::ranges::any_of(of.parameters(), [&](const sl::Parameter& p) { return p.name == name; });
    };
    const bool layered = ref->parameters.find(":layers") != nullptr;
    if (has(*shader) || (shader->coshaders() == sl::CoShaderUse::None && !layered))
        return has(*shader);
    Scope scope = {&ref->coshaders};
    if (attributes)
        scope.push_back(&attributes->coshaders);
    const Network network = connect_coshaders(
        *shader, *ref, scope, [this](const scene::ShaderRef& r) { return load_coshader(r); }, m_journal);
    return std::ranges::any_of(network.coshaders, [&](const CoShader& c) { return has(*c.shader); });
}

} // namespace kanuka::shade
