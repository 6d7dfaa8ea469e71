#include "shade/system_impl.h"

#define XXH_INLINE_ALL
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <xxhash.h>

#include "grid/lobe_table.h"
#include "scene/coordinate_system.h"
#include "shade/area_light.h"
#include "shade/default_surface.h"
#include "shade/light_table.h"
#include "shade/lights.h"
#include "shade/opacity.h"
#include "shade/spread_light.h"
#include "shade/variants.h"

namespace kanuka::shade {

namespace {

template <class T>
void append(std::string& bytes, const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

} // namespace

// All that materials share which differ in colours and places alone.
std::string SystemImpl::core_key(const BoundShaders& bound, const scene::Attributes& attributes,
                                 const MaterialImpl::Own& own, const DefaultSurface& coverage) const {
    std::string key;
    for (const Bound* b : bound.all()) {
        append(key, b->shader ? b->shader->hash() : uint64_t(0));
        key += serialize(b->arguments) + ";";
    }
    append(key, bound.air);
    if (attributes.area_light)
        append(key, own.emission);
    if (bound.area_light.shader)
        if (const auto spread = m_spread.find(spread_key(*attributes.area_light)); spread != m_spread.end()) {
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
    return key;
}

// How bright a surface is that shines by a light shader, and in which directions.
void SystemImpl::run_area_light_of(MaterialCore& core, const Bound& light, const std::string& key,
                                   const std::string& name, const MaterialImpl::Own& own) {
    Spaces spaces = own.spaces;
    spaces.current_from_shader = own.area_light_from_shader;
    MaterialServices services(spaces, own.facts, m_textures, m_journal, light.where);
    std::optional<sl::Emission> radiance;
    if (const auto spread = m_spread.find(key); spread != m_spread.end())
        radiance = spread_radiance(*core.area_light, spread->second, own.spaces.current_from_world,
                                   m_lit_middle, services);
    if (radiance) { // the same all over
        core.read.world = true;
        core.read.add(services.read());
        m_journal.report(Severity::Info, light.where,
                         "area light \"" + name +
                             "\" shines from a place of its own, not from the surface: the surface is as "
                             "bright as what the shader says arrives in the middle of the scene");
        core.emission = {radiance->Cl[0], radiance->Cl[1], radiance->Cl[2]};
        core.program.emission_cosine = cone_of(*radiance);
        core.area_light.reset();
        return;
    }
    grid::Grid point;
    point.allocate(0, 0);
    const sl::Emission emission = run_area_light(*core.area_light, point, {}, services);
    const size_t stride = size_t(point.stride);
    core.emission = {emission.Cl[0], emission.Cl[stride], emission.Cl[2 * stride]};
    core.light_varies = !emission.uniform;
    core.program.emission_cosine = cone_of(emission);
    core.read.add(services.read());
    core.shared = core.shared && !services.asked_for_attributes();
}

// Surfaces whose loops run for the lights of the scene: which of them they wait for.
void SystemImpl::want_lights(MaterialCore& core) {
    if (!m_gathers_light || !core.surface_shader || !core.surface_shader->has_light_of_its_own() ||
        !core.program.emission() || core.program.emission()->inputs[grid::EmissionRadiance] < 0)
        return;
    std::vector<bool> shadows;
    for (const PointLights::One& one : m_point_lights.all())
        shadows.push_back(one.light.shadows);
    add_lit_by(core.program, shadows);
    core.wanted_lights = shadows;
    core.wanted_lights.flip();
}

std::shared_ptr<const MaterialCore> SystemImpl::core(const BoundShaders& bound,
                                                     const scene::Attributes& attributes,
                                                     const MaterialImpl::Own& own,
                                                     const DefaultSurface& coverage) {
    const Bound &surface = bound.surface, &displacement = bound.displacement;
    const std::string key = core_key(bound, attributes, own, coverage);
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
    const auto instantiate = [&](const Bound& of, const Transform& current_from_shader) {
        Spaces spaces = own.spaces;
        spaces.current_from_shader = current_from_shader;
        MaterialServices services(spaces, own.facts, m_textures, m_journal, of.where);
        auto instance = of.shader->instantiate(of.arguments, services);
        core->read.add(services.read());
        core->shared = core->shared && !services.asked_for_attributes();
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
            run_area_light_of(*core, bound.area_light, spread_key(*attributes.area_light),
                              attributes.area_light->name, own);
        }
    }
    add_aovs(core->program, *core->surface, m_compile_options.aovs);
    core->surface_aovs = core->program.aovs.size();
    for (const PrimvarAov& aov : own.primvar_aovs)
        if (std::ranges::find(core->program.aovs, aov.index, &grid::Aov::index) == core->program.aovs.end())
            add_aov(core->program, aov.index, aov.name, aov.type, aov.components);
    core->program.air = bound.air;
    want_lights(*core);
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
        const Digest identity = m_textures.identity(name);
        append(bytes, identity.high);
        append(bytes, identity.low);
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

void SystemImpl::set_spaces(MaterialImpl::Own& own, const scene::Attributes& attributes,
                            const Transform& current_from_object, const Transform& current_from_world) const {
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
}

DefaultSurface SystemImpl::set_colors(MaterialImpl::Own& own, const scene::Primitive& primitive,
                                      const scene::Attributes& attributes) {
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
    return coverage;
}

// Shaders and their values.
BoundShaders SystemImpl::bind_all(MaterialImpl::Own& own, const scene::Primitive& primitive,
                                  const scene::Attributes& attributes, const DefaultSurface& coverage) {
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
    own.facts = {&attributes, &m_options, &m_camera, &m_point_lights};
    return bound;
}

// Of what is shared, and what is a primitive's own, but for where it stands.
std::string SystemImpl::material_key(const MaterialCore& shared, const BoundShaders& bound,
                                     const MaterialImpl::Own& own,
                                     const scene::Attributes& attributes) const {
    std::string key = shared.key;
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
    return key;
}

std::shared_ptr<const Material> SystemImpl::material(const scene::Primitive& primitive,
                                                     const Transform& current_from_object,
                                                     const Transform& current_from_world,
                                                     std::span<const scene::ValueList> variants) {
    std::vector<std::shared_ptr<const Material>> materials;
    const auto add = [&](const scene::Primitive& variant) {
        materials.push_back(plain_material(variant, current_from_object, current_from_world));
    };
    const int own = primitive.attributes ? primitive.attributes->variants : 1;
    if (variants.empty() && own <= 1)
        return plain_material(primitive, current_from_object, current_from_world);
    for (const scene::ValueList& variables : variants)
        add(with_variables(primitive, variables));
    for (int k = 0; variants.empty() && k < own; k++)
        add(with_variant(primitive, float(k)));
    return make_variants(primitive, std::move(materials), m_journal);
}

std::shared_ptr<const Material> SystemImpl::plain_material(const scene::Primitive& primitive,
                                                           const Transform& current_from_object,
                                                           const Transform& current_from_world) {
    static const scene::Attributes fallback;
    const scene::Attributes& attributes = primitive.attributes ? *primitive.attributes : fallback;
    MaterialImpl::Own own;
    set_spaces(own, attributes, current_from_object, current_from_world);
    const DefaultSurface coverage = set_colors(own, primitive, attributes);
    const BoundShaders bound = bind_all(own, primitive, attributes, coverage);
    own.primvar_aovs = primvar_aovs(primitive, m_compile_options.aovs);
    std::shared_ptr<const MaterialCore> shared = core(bound, attributes, own, coverage);
    const auto by_surface = std::span(shared->program.aovs).first(shared->surface_aovs);
    std::erase_if(own.primvar_aovs, [&](const PrimvarAov& aov) {
        return std::ranges::any_of(by_surface, [&](const grid::Aov& a) { return a.index == aov.index; });
    });
    std::string key = material_key(*shared, bound, own, attributes);
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
