// Lights and imagers: what runs shaders, and is no material.
#include <algorithm>
#include <filesystem>
#include <set>

#include "shade/light_table.h"
#include "shade/lights.h"
#include "shade/system_impl.h"

namespace kanuka::shade {

bool SystemImpl::all_classic(const scene::Scene& scene) {
    std::set<std::string> known;
    const scene::Attributes* last = nullptr;
    const auto classic = [&](const scene::Primitive& p) {
        if (!p.attributes || p.attributes.get() == last)
            return true;
        last = p.attributes.get();
        if (last->area_light)
            return false;
        if (!last->surface || !known.insert(last->surface->name).second)
            return true;
        const auto path = find(*last->surface);
        const Loaded shader = path ? compile(*path, *path, m_compile_options) : nullptr;
        return !shader || (shader->kind() != sl::ShaderKind::Class && !shader->asks_for_interreflection());
    };
    const auto of_rispec = [&](const scene::ShaderRef& light) {
        return !is_standard_light(light.name) || has_its_own(light) || is_classic_light(light);
    };
    return scene.lights.empty() && std::ranges::all_of(scene.light_shaders, of_rispec) &&
           std::ranges::all_of(scene.primitives, classic) &&
           std::ranges::all_of(scene.groups, [&](const scene::Group& g) {
               return std::ranges::all_of(g.primitives, classic);
           });
}

// Does the scene bring a shader of that name, which one that ships has, too?
bool SystemImpl::has_its_own(const scene::ShaderRef& ref) const {
    const auto path = find(ref);
    return path && std::filesystem::path(*path).parent_path() != std::filesystem::path(m_standard_shaders);
}

// Lights live in world space: their "current" is the world.
std::optional<scene::Light> SystemImpl::run_light(const scene::ShaderRef& ref, const Bounds3f& lit) {
    if (!find(ref))
        return make_stand_in(ref, join_folders(m_shader_folders), m_textures, m_journal);
    Bound bound;
    bound.shader = load(ref, sl::ShaderKind::Light);
    if (!bound.shader)
        return std::nullopt;
    Spaces spaces;
    spaces.shared = &m_world_spaces;
    spaces.current_from_object = spaces.current_from_shader = ref.world_from_shader;
    const Facts facts{nullptr, &m_options, &m_camera};
    MaterialServices services(spaces, facts, m_textures, m_journal, ref.where);
    bound.arguments = bind_arguments(*bound.shader, ref, {}, spaces, m_journal);
    connect(bound, ref, {&ref.coshaders}, {}, spaces);
    const auto instance = bound.shader->instantiate(bound.arguments, services);
    std::optional<scene::Light> light = shade_light(*instance, ref, lit, services);
    if (light)
        light->shadows = casts_shadows(ref, bound.shader.get());
    return light;
}

// Those that shine from somewhere: skies and ambient light have no direction, lights of an extent several.
std::vector<PointLights::One> SystemImpl::make_point_lights() {
    using Kind = scene::Light::Kind;
    std::vector<PointLights::One> all;
    const auto shines = [](const scene::Light& light) {
        return light.unit.empty() &&
               (light.kind == Kind::Distant || light.kind == Kind::Point || light.kind == Kind::Spot);
    };
    for (const scene::Light& light : m_lights)
        if (shines(light))
            all.push_back({light, nullptr});
    for (scene::ShaderRef ref : m_light_shaders) {
        if (!m_gathers_light && !ref.shadows) // all lights cast shadows then
            ref.shadows = true;
        PointLights::One one;
        Journal heard; // when the light was made for tracing
        if (is_standard_light(ref.name) && !has_its_own(ref)) {
            const auto light = make_light(ref, m_textures, heard);
            if (!light || !shines(*light))
                continue;
            one.light = *light;
        } else {
            const auto path = find(ref);
            const Loaded shader = path ? compile(*path, *path, m_compile_options) : nullptr;
            if (!shader || shader->kind() != sl::ShaderKind::Light)
                continue;
            struct Running {
                Spaces spaces;
                Facts facts;
                Loaded shader;
                std::unique_ptr<sl::Instance> instance;
            };
            const auto run = std::make_shared<Running>();
            run->spaces.shared = &m_world_spaces;
            run->spaces.current_from_object = run->spaces.current_from_shader = ref.world_from_shader;
            run->facts = {nullptr, &m_options, &m_camera};
            run->shader = shader;
            MaterialServices services(run->spaces, run->facts, m_textures, m_journal, ref.where);
            run->instance =
                shader->instantiate(bind_arguments(*shader, ref, {}, run->spaces, heard), services);
            one.light.name = ref.handle;
            one.light.shadows = casts_shadows(ref, shader.get());
            one.shader = [this, run, where = ref.where](grid::Grid& points) {
                MaterialServices asked(run->spaces, run->facts, m_textures, m_journal, where);
                return run->instance->emit(points, {}, asked);
            };
        }
        all.push_back(std::move(one));
    }
    return all;
}

std::vector<Lamp> SystemImpl::lamps() {
    std::vector<Lamp> all;
    for (const PointLights::One& one : m_point_lights.all()) {
        float origin[3] = {0, 0, 0}, L[3], Cl[3];
        const bool far = m_point_lights.at({int(all.size()),
                                            1,
                                            {&origin[0], &origin[1], &origin[2]},
                                            {&L[0], &L[1], &L[2]},
                                            {&Cl[0], &Cl[1], &Cl[2]}},
                                           Transform());
        all.push_back({one.light, {L[0], L[1], L[2]}, far});
    }
    return all;
}

std::vector<scene::Light> SystemImpl::lights(const std::vector<scene::ShaderRef>& shaders,
                                             const Bounds3f& lit) {
    std::vector<scene::Light> all;
    for (const scene::ShaderRef& ref : shaders) {
        std::optional<scene::Light> light = is_standard_light(ref.name) && !has_its_own(ref)
                                                ? make_light(ref, m_textures, m_journal)
                                                : run_light(ref, lit);
        if (light)
            all.push_back(std::move(*light));
    }
    return all;
}

// Rows of pixels are grids, so that derivatives and noise are those of neighbouring pixels.
void SystemImpl::image(const scene::ShaderRef& ref, const ImagerPixels& pixels) {
    const Loaded shader = load(ref, sl::ShaderKind::Imager);
    if (!shader)
        return;
    Spaces spaces;
    spaces.shared = &m_world_spaces;
    spaces.current_from_object = spaces.current_from_shader = ref.world_from_shader;
    const Facts facts{nullptr, &m_options, &m_camera};
    MaterialServices services(spaces, facts, m_textures, m_journal, ref.where);
    const auto instance = shader->instantiate(bind_arguments(*shader, ref, {}, spaces, m_journal), services);
    const size_t width = size_t(pixels.width);
    const int rows = std::clamp((1 << 16) / std::max(pixels.width, 1), 2, 64);
    for (int y0 = 0; y0 < pixels.height; y0 += rows) {
        const int count = std::min(rows, pixels.height - y0);
        grid::Grid g;
        g.allocate(pixels.width - 1, count - 1);
        const size_t stride = size_t(g.stride), first = size_t(y0) * width, n = width * size_t(count);
        const std::vector<float> black(3 * stride + 32, 0.0f);
        grid::Channel color{"Cs", 3, g.stride, black}, opacity{"Os", 3, g.stride, black};
        const std::span<float> channels[] = {pixels.r, pixels.g, pixels.b};
        for (size_t i = 0; i < n; i++) {
            const size_t column = i % width, row = i / width;
            const float x = float(pixels.x0) + float(column) + 0.5f,
                        y = float(pixels.y0 + y0) + float(row) + 0.5f;
            g.P[i] = x, g.P[stride + i] = y;
            g.u[i] = g.s[i] = x / float(pixels.full_width);
            g.v[i] = g.t[i] = y / float(pixels.full_height);
            for (size_t c = 0; c < 3; c++) {
                color.data[c * stride + i] = channels[c][first + i];
                opacity.data[c * stride + i] = pixels.alpha[first + i];
            }
        }
        g.primvars = {std::move(color), std::move(opacity)};
        const sl::Filtered f = instance->filter(g, {}, services);
        for (size_t i = 0; i < n; i++) {
            for (size_t c = 0; c < 3; c++)
                channels[c][first + i] = f.Ci[c * stride + i];
            pixels.alpha[first + i] = f.alpha[i];
        }
    }
}

} // namespace kanuka::shade
