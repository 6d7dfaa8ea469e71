#include "shade/system_impl.h"

#define XXH_INLINE_ALL
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <future>
#include <map>
#include <mutex>
#include <unordered_map>
#include <xxhash.h>

#include "grid/lobe_table.h"
#include "scene/coordinate_system.h"
#include "shade/area_light.h"
#include "shade/arguments.h"
#include "shade/coshaders.h"
#include "shade/default_surface.h"
#include "shade/foreign.h"
#include "shade/light_table.h"
#include "shade/lights.h"
#include "shade/make_texture.h"
#include "shade/material.h"
#include "shade/opacity.h"
#include "shade/search.h"
#include "shade/spread_light.h"

namespace kanuka::shade {

namespace {

constexpr const char* ShaderExtensions[] = {".slo", ".sl"};
constexpr const char* AsNamed[] = {""};

template <class T>
void append(std::string& bytes, const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

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

std::shared_ptr<const MaterialCore> SystemImpl::core(const BoundShaders& bound,
                                                     const scene::Attributes& attributes,
                                                     const MaterialImpl::Own& own,
                                                     const DefaultSurface& coverage) {
    const Bound &surface = bound.surface, &displacement = bound.displacement;
    std::string key;
    for (const Bound* b : bound.all()) {
        append(key, b->shader ? b->shader->hash() : uint64_t(0));
        key += serialize(b->arguments) + ";";
    }
    append(key, bound.air);
    if (attributes.area_light)
        append(key, own.emission);
    const auto spread =
        bound.area_light.shader ? m_spread.find(spread_key(*attributes.area_light)) : m_spread.end();
    if (spread != m_spread.end()) {
        key += spread->first;
        append(key, m_lit_middle);
    }
    append(key, char((attributes.area_light ? 1 : 0) | (coverage.varying_color ? 2 : 0) |
                     (coverage.has_presence ? 4 : 0) | (coverage.varying_presence ? 8 : 0) |
                     (attributes.sides == 2 ? 16 : 0)));
    for (const PrimvarAov& aov : own.primvar_aovs) {
        append(key, aov.index);
        append(key, aov.type);
        append(key, aov.components);
    }
    if (own.spaces.scoped)
        for (const scene::Value& v : own.spaces.scoped->values)
            if (scene::is_coordinate_system(v)) {
                key += v.name;
                key.append(reinterpret_cast<const char*>(v.floats.data()), 16 * sizeof(float));
            }
    const auto known = [&]() -> std::shared_ptr<const MaterialCore> {
        for (const auto& one : m_cores[key])
            if (own.digest_of(one->read) == one->of_read)
                return one;
        return nullptr;
    };
    {
        std::lock_guard lock(m_mutex);
        if (auto found = known())
            return found;
    }
    auto core = std::make_shared<MaterialCore>();
    const auto note = [&](const MaterialServices& services) {
        core->read.add(services.read());
        core->shared = core->shared && !services.asked_for_attributes();
    };
    const auto instantiate = [&](const Bound& bound, const Transform& current_from_shader) {
        Spaces spaces = own.spaces;
        spaces.current_from_shader = current_from_shader;
        MaterialServices services(spaces, own.facts, m_textures, m_journal, bound.where);
        auto instance = bound.shader->instantiate(bound.arguments, services);
        note(services);
        return instance;
    };
    if (surface.shader)
        core->surface = instantiate(surface, own.spaces.current_from_shader);
    if (core->surface)
        core->surface_shader = surface.shader;
    else
        core->surface = make_default_surface(coverage);
    if (displacement.shader) {
        core->displacement = instantiate(displacement, own.displacement_from_shader);
        core->displacement_shader = displacement.shader;
        if (core->displacement && !core->displacement->displaces())
            core->displacement.reset();
    }
    core->program = core->surface->program();
    const bool lit_from_eye = surface.shader && !attributes.surface;
    core->program.shines_both =
        (core->program.shines_both || lit_from_eye) && attributes.sides == 2 && !attributes.area_light;
    if (coverage.has_presence && core->program.presence < 0 &&
        core->surface->shader().kind() == sl::ShaderKind::Class)
        core->presence_slot = core->program.presence =
            add_presence_slot(core->program, !coverage.varying_presence);
    if (attributes.area_light) {
        core->emission = own.emission;
        core->emission_slot = add_emission(core->program);
        if (bound.area_light.shader)
            core->area_light = instantiate(bound.area_light, own.area_light_from_shader);
        if (core->area_light) {
            core->area_light_shader = bound.area_light.shader;
            grid::Grid point;
            point.allocate(0, 0);
            Spaces spaces = own.spaces;
            spaces.current_from_shader = own.area_light_from_shader;
            MaterialServices services(spaces, own.facts, m_textures, m_journal, bound.area_light.where);
            std::optional<sl::Emission> radiance;
            if (spread != m_spread.end())
                radiance = spread_radiance(*core->area_light, spread->second, own.spaces.current_from_world,
                                           m_lit_middle, services);
            core->read.world |= radiance.has_value();
            if (radiance) { // the same all over
                m_journal.report(
                    Severity::Info, bound.area_light.where,
                    "area light \"" + attributes.area_light->name +
                        "\" shines from a place of its own, not from the surface: the surface is as "
                        "bright as what the shader says arrives in the middle of the scene");
                core->emission = {radiance->Cl[0], radiance->Cl[1], radiance->Cl[2]};
                core->program.emission_cosine = cone_of(*radiance);
                core->area_light.reset();
            } else {
                const sl::Emission light = run_area_light(*core->area_light, point, {}, services);
                const size_t stride = size_t(point.stride);
                core->emission = {light.Cl[0], light.Cl[stride], light.Cl[2 * stride]};
                core->light_varies = !light.uniform;
                core->program.emission_cosine = cone_of(light);
            }
            note(services);
        }
    }
    add_aovs(core->program, *core->surface, m_compile_options.aovs);
    core->surface_aovs = core->program.aovs.size();
    for (const PrimvarAov& aov : own.primvar_aovs)
        if (std::ranges::find(core->program.aovs, aov.index, &grid::Aov::index) == core->program.aovs.end())
            add_aov(core->program, aov.index, aov.name, aov.type, aov.components);
    core->program.air = bound.air;
    if (m_gathers_light && core->surface_shader && core->surface_shader->has_light_of_its_own() &&
        core->program.emission() && core->program.emission()->inputs[grid::EmissionRadiance] >= 0) {
        std::vector<bool> shadows;
        for (const PointLights::One& one : m_point_lights.all())
            shadows.push_back(one.light.shadows);
        add_lit_by(core->program, shadows);
        core->wanted_lights = shadows;
        core->wanted_lights.flip();
    }
    core->ranges = m_ranges;
    core->key = key;
    core->of_read = own.digest_of(core->read);
    if (!core->shared) // what mnk_init decided holds for this primitive alone
        return core;
    std::lock_guard lock(m_mutex);
    if (auto found = known()) // another thread was first
        return found;
    m_cores[key].push_back(core);
    return core;
}

// Files that string parameters name count with their size and time of change: a texture painted anew is
// another material.
uint64_t SystemImpl::hash(const std::string& key, const BoundShaders& shaders) const {
    std::string bytes = key;
    const auto add_file = [&](const std::string& name) {
        const std::string path = name.empty() ? "" : m_textures.find(name);
        if (path.empty())
            return;
        std::error_code failed;
        append(bytes, uint64_t(std::filesystem::file_size(path, failed)));
        append(bytes, std::filesystem::last_write_time(path, failed).time_since_epoch().count());
    };
    for (const Bound* bound : shaders.all()) {
        for (const sl::Argument& a : bound->arguments)
            for (const std::string& s : a.strings)
                add_file(s);
        if (bound->shader)
            for (const sl::Parameter& p : bound->shader->parameters())
                for (const std::string& s : p.strings)
                    add_file(s);
    }
    return XXH3_64bits(bytes.data(), bytes.size());
}

std::shared_ptr<const Material> SystemImpl::material(const scene::Primitive& primitive,
                                                     const Transform& current_from_object,
                                                     const Transform& current_from_world) {
    static const scene::Attributes fallback;
    const scene::Attributes& attributes = primitive.attributes ? *primitive.attributes : fallback;

    // 1. Spaces, colours
    MaterialImpl::Own own;
    own.spaces.shared = &m_world_spaces;
    own.spaces.current_from_object = current_from_object;
    if (std::ranges::any_of(attributes.user.values, scene::is_coordinate_system))
        own.spaces.scoped = &attributes.user;
    own.spaces.current_from_world = current_from_world;
    const auto shader_space = [&](const std::optional<scene::ShaderRef>& ref) {
        return ref ? current_from_world * ref->world_from_shader : current_from_object;
    };
    own.spaces.current_from_shader = shader_space(attributes.surface);
    own.displacement_from_shader = shader_space(attributes.displacement);
    own.area_light_from_shader = shader_space(attributes.area_light);
    own.color = attributes.color;
    own.opacity = attributes.opacity;
    if (m_palette) {
        if (!attributes.color_spectrum.empty())
            own.color = measured_color(attributes.color_spectrum, own.color, primitive.where);
        if (attributes.area_light)
            own.emission =
                area_light_amount(*attributes.area_light, m_palette, m_textures.folders(), m_journal);
    } else if (attributes.area_light)
        own.emission = light_amount(*attributes.area_light);
    if (attributes.area_light && shines_by_intensity(attributes)) {
        const auto spread = m_spread.find(spread_key(*attributes.area_light));
        if (spread != m_spread.end() && spread->second.area > 0) {
            own.emission = own.emission * (Pi / spread->second.area);
            m_journal.report(
                Severity::Info, attributes.area_light->where,
                "\"arealight\" with Attribute \"light\" \"nsamples\" is BMRT's: its radiance is pi times "
                "the intensity, over the area");
        }
    }
    DefaultSurface coverage;
    const auto take_primvar = [&](const char* name, Rgb& constant, bool& varying) {
        const scene::Value* v = primitive.primvars.find(name);
        if (!v || v->type != scene::Type::Color)
            return;
        if (!is_constant(*v))
            varying = true;
        else if (v->floats.size() >= 3)
            constant = {v->floats[0], v->floats[1], v->floats[2]};
    };
    take_primvar("Cs", own.color, coverage.varying_color);
    take_primvar("Os", own.opacity, coverage.varying_presence);
    coverage.has_presence = coverage.varying_presence || !(own.opacity == Rgb(1));
    own.varying_color_or_opacity = coverage.varying_color || coverage.varying_presence;

    // 2. Shaders and their values
    const bool own_light = attributes.area_light && attributes.area_light->name != "arealight" &&
                           find(*attributes.area_light).has_value();
    if (attributes.area_light && !own_light && !shines_by_intensity(attributes))
        check_area_light(*attributes.area_light, m_journal);
    const auto bind_in = [&](const std::optional<scene::ShaderRef>& ref, sl::ShaderKind wanted,
                             const Transform& current_from_shader) {
        Spaces spaces = own.spaces;
        spaces.current_from_shader = current_from_shader;
        return bind(ref, wanted, primitive, spaces);
    };
    BoundShaders bound;
    const bool by_default = !attributes.surface && !attributes.area_light;
    bound.surface = bind_in(by_default ? m_default_surface : attributes.surface, sl::ShaderKind::Surface,
                            own.spaces.current_from_shader);
    bound.displacement =
        bind_in(attributes.displacement, sl::ShaderKind::Displacement, own.displacement_from_shader);
    if (attributes.atmosphere)
        bound.air = air_of(*attributes.atmosphere, primitive);
    if (own_light)
        bound.area_light = bind_in(attributes.area_light, sl::ShaderKind::Light, own.area_light_from_shader);
    if (bound.surface.shader)
        add_colors(bound.surface.arguments, own.opacity, coverage);
    own.surface_where = bound.surface.where;
    own.displacement_where = bound.displacement.where;
    own.area_light_where = bound.area_light.where;
    own.attributes = primitive.attributes;
    own.facts = {primitive.attributes ? primitive.attributes.get() : &fallback, &m_options, &m_camera,
                 &m_point_lights};

    // 3. What is shared, then what is this primitive's own
    own.primvar_aovs = primvar_aovs(primitive, m_compile_options.aovs);
    std::shared_ptr<const MaterialCore> shared = core(bound, attributes, own, coverage);
    const auto by_surface = std::span(shared->program.aovs).first(shared->surface_aovs);
    std::erase_if(own.primvar_aovs, [&](const PrimvarAov& aov) {
        return std::ranges::any_of(by_surface, [&](const grid::Aov& a) { return a.index == aov.index; });
    });
    std::string key = shared->key;
    for (const PrimvarAov& aov : own.primvar_aovs) {
        key += aov.name;
        append(key, aov.varying);
        append(key, aov.value);
    }
    append(key, own.color);
    append(key, own.opacity);
    for (const Bound* b : bound.all())
        if (b->shader && (b->shader->queries() || b->shader->has_light_of_its_own())) {
            key += attribute_key(attributes);
            append(key, m_facts_key);
            break;
        }
    const uint64_t content = hash(key, bound);
    for (const Transform* t :
         {&own.spaces.current_from_object, &own.spaces.current_from_world, &own.spaces.current_from_shader,
          &own.displacement_from_shader, &own.area_light_from_shader, &m_world_spaces.camera_from_world})
        append(key, t->m);
    const XXH128_hash_t name = XXH3_128bits(key.data(), key.size());
    const std::pair id(name.high64, name.low64);
    {
        std::lock_guard lock(m_mutex);
        if (const auto found = m_materials.find(id); found != m_materials.end())
            return found->second;
    }
    auto material = std::make_shared<MaterialImpl>(shared, own, m_textures, m_journal, content);
    std::lock_guard lock(m_mutex);
    return m_materials.try_emplace(id, std::move(material)).first->second;
}

// Air lies in the world, whatever it is seen with.
int SystemImpl::air_of(const scene::ShaderRef& ref, const scene::Primitive& primitive) {
    Spaces spaces;
    spaces.shared = &m_world_spaces;
    spaces.current_from_object = spaces.current_from_world = m_render_from_world;
    spaces.current_from_shader = m_render_from_world * ref.world_from_shader;
    const Bound bound = bind(ref, sl::ShaderKind::Volume, primitive, spaces);
    if (!bound.shader)
        return -1;
    std::string key = serialize(bound.arguments);
    append(key, bound.shader->hash());
    append(key, spaces.current_from_shader.m);
    if (bound.shader->queries())
        key += attribute_key(*primitive.attributes);
    {
        std::lock_guard lock(m_mutex);
        if (const auto found = m_air_of.find(key); found != m_air_of.end())
            return found->second;
    }
    auto air = std::make_unique<AirOfShader>(
        bound.shader, bound.arguments, spaces,
        Facts{primitive.attributes.get(), &m_options, &m_camera, &m_point_lights}, m_textures, m_journal,
        bound.where, primitive.attributes);
    std::lock_guard lock(m_mutex);
    const auto [place, fresh] = m_air_of.try_emplace(key, int(m_airs.size()));
    if (fresh) // else another thread was first
        m_airs.push_back(std::move(air));
    return place->second;
}

// Segments from the eye to some points of what is seen.
void SystemImpl::check_air(const Bounds3f& seen) {
    Spaces world;
    world.shared = &m_world_spaces;
    world.current_from_world = m_render_from_world;
    const Vec3f eye = world.eye();
    grid::AirSegments segments;
    segments.count = seen.empty() ? 0 : 16;
    for (int i = 0; i < segments.count; i++) {
        segments.seed[i] = i;
        constexpr int Bases[] = {2, 3, 5};
        for (int c = 0; c < 3; c++) {
            float x = 0, digit = 1;
            for (int k = i + 1; k > 0; k /= Bases[c])
                x += (digit /= float(Bases[c])) * float(k % Bases[c]);
            segments.from[c][i] = eye[c];
            segments.to[c][i] = seen.lo[c] + x * (seen.hi[c] - seen.lo[c]);
        }
    }
    for (const auto& air : m_airs)
        if (segments.count > 0)
            air->check(segments);
}

std::unique_ptr<ShadingSystem> make_shading_system(const ShadingOptions& options, const scene::Scene& scene,
                                                   Journal& journal, CompileShader compile) {
    return std::make_unique<SystemImpl>(options, scene, journal, std::move(compile));
}

} // namespace kanuka::shade
