// The shading system: what it keeps, and who does what. system_shaders.cpp finds, compiles and binds shaders;
// system.cpp makes materials of them; system_lights.cpp runs what is no material: lights and imagers.
#pragma once

#include <array>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <unordered_map>

#include "scene/digest.h"
#include "shade/air.h"
#include "shade/area_light.h"
#include "shade/arguments.h"
#include "shade/coshaders.h"
#include "shade/default_surface.h"
#include "shade/lights.h"
#include "shade/make_texture.h"
#include "shade/material.h"
#include "shade/point_lights.h"
#include "shade/search.h"
#include "shade/spread_light.h"
#include "shade/system.h"

namespace kanuka::shade {

// A shader found, compiled and with its values bound; null where there is none.
struct Bound {
    std::shared_ptr<const sl::Shader> shader;
    std::vector<sl::Argument> arguments;
    Location where;
};

struct BoundShaders {
    Bound surface, displacement, area_light;
    int air = -1;
    std::array<const Bound*, 3> all() const { return {&surface, &displacement, &area_light}; }
};

class SystemImpl final : public ShadingSystem {
  public:
    SystemImpl(const ShadingOptions& options, const scene::Scene& scene, Journal& journal,
               CompileShader compile)
        : m_journal(journal), m_palette(options.palette), m_compile(std::move(compile)),
          m_shader_folders(search_folders(options.shader_path, scene.file, options.standard_shaders)),
          m_standard_shaders(options.standard_shaders),
          m_textures(search_folders(options.texture_path, scene.file, ""), options.texture_bytes, journal),
          m_render_from_world(options.render_from_world),
          m_options(options.options ? *options.options : scene.options),
          m_camera(options.camera ? *options.camera : scene.camera),
          m_world_spaces(scene, m_options, m_camera, options.camera_from_render * options.render_from_world) {
        if (m_palette)
            m_textures.set_space(m_palette->space());
        m_textures.set_made(make_textures(scene.options.user, m_textures.folders(), journal));
        m_compile_options.lanes = options.lanes;
        m_compile_options.cache_dir = options.cache_dir;
        m_compile_options.include_path = m_shader_folders;
        m_compile_options.strict_directions = m_options.strict_directions;
        m_compile_options.array_room = m_options.array_room;
        m_compile_options.rispec_specular = m_options.specular == "rispec";
        m_compile_options.aovs = options.aovs;
        m_light_shaders = scene.light_shaders;
        m_lights = scene.lights;
        m_facts_key = digest_of(m_options, m_options.samples, m_options.exposure_gain,
                                m_options.exposure_gamma, m_camera, scene::digest_of_lights(scene));
        m_spread = spread_lights(scene, m_lit_middle);
        note_names(scene.primitives);
        for (const scene::Group& g : scene.groups)
            note_names(g.primitives);
    }

    std::shared_ptr<const Material> material(const scene::Primitive& primitive,
                                             const Transform& current_from_object,
                                             const Transform& current_from_world,
                                             std::span<const scene::ValueList> variants) override;
    bool surface_reads(const scene::Primitive& primitive, std::string_view name) override;
    std::shared_ptr<const Material> plain_material(const scene::Primitive& primitive,
                                                   const Transform& current_from_object,
                                                   const Transform& current_from_world);
    std::vector<scene::Light> lights(const std::vector<scene::ShaderRef>& shaders,
                                     const Bounds3f& lit) override;
    void find_files(scene::Light& light) override { find_light_files(light, m_textures, m_journal); }
    void image(const scene::ShaderRef& imager, const ImagerPixels& pixels) override;
    uint64_t texture_bytes() const override { return m_textures.bytes(); }
    uint64_t textures_made() const override { return m_textures.made(); }

  private:
    using Loaded = std::shared_ptr<const sl::Shader>;
    using Scope = std::vector<const std::vector<scene::ShaderRef>*>;

    void note_names(const std::vector<scene::Primitive>& primitives);
    std::optional<std::string> find(const scene::ShaderRef& ref) const;
    std::string not_found(const scene::ShaderRef& ref, const Location& asker) const;
    bool has_its_own(const scene::ShaderRef& ref) const;
    bool all_classic(const scene::Scene& scene) override;
    void light_defaults_from_eye() override {
        m_default_surface = scene::ShaderRef{.name = "defaultsurface"};
        m_gathers_light = true;
    }
    void report_ranges() override { m_ranges->report(m_journal); }
    bool knows(const scene::ShaderRef& shader) const override { return find(shader).has_value(); }
    Loaded load(const scene::ShaderRef& ref, sl::ShaderKind wanted, bool area_light = false);
    Loaded compile(const std::string& key, const std::string& path, const sl::CompileOptions& options);
    std::optional<CoShader> load_coshader(const scene::ShaderRef& ref);
    void connect(Bound& bound, const scene::ShaderRef& ref, const Scope& scope,
                 const scene::ValueList& primvars, const Spaces& spaces, bool area_light = false);
    std::vector<PointLights::One> make_point_lights();
    std::vector<Lamp> lamps() override;
    int air_of(const scene::ShaderRef& ref, const scene::Primitive& primitive);
    void evaluate(int air, grid::AirSegments& segments, AirLights& lights) override {
        air_at(air).evaluate(segments, &lights);
    }
    void check_air(const Bounds3f& seen) override;
    bool has_air() const override { return !m_airs.empty(); }
    const AirOfShader& air_at(int air) {
        std::lock_guard lock(m_mutex);
        return *m_airs[size_t(air)];
    }
    std::optional<scene::Light> run_light(const scene::ShaderRef& ref, const Bounds3f& lit);
    scene::ShaderRef with_measured_colors(const scene::ShaderRef& ref, const sl::Shader& shader);
    Rgb measured_color(const std::string& name, const Rgb& instead, const Location& where);
    Bound bind(const std::optional<scene::ShaderRef>& ref, sl::ShaderKind wanted,
               const scene::Primitive& primitive, const Spaces& spaces);
    std::shared_ptr<const MaterialCore> core(const BoundShaders& bound, const scene::Attributes& attributes,
                                             const MaterialImpl::Own& own, const DefaultSurface& coverage);
    std::string core_key(const BoundShaders& bound, const scene::Attributes& attributes,
                         const MaterialImpl::Own& own, const DefaultSurface& coverage) const;
    void run_area_light_of(MaterialCore& core, const Bound& light, const std::string& key,
                           const std::string& name, const MaterialImpl::Own& own);
    void want_lights(MaterialCore& core);
    void set_spaces(MaterialImpl::Own& own, const scene::Attributes& attributes,
                    const Transform& current_from_object, const Transform& current_from_world) const;
    DefaultSurface set_colors(MaterialImpl::Own& own, const scene::Primitive& primitive,
                              const scene::Attributes& attributes);
    BoundShaders bind_all(MaterialImpl::Own& own, const scene::Primitive& primitive,
                          const scene::Attributes& attributes, const DefaultSurface& coverage);
    std::string material_key(const MaterialCore& shared, const BoundShaders& bound,
                             const MaterialImpl::Own& own, const scene::Attributes& attributes) const;
    uint64_t hash(const std::string& key, const BoundShaders& bound) const;

    Journal& m_journal;
    color::Palette* m_palette;
    CompileShader m_compile;
    sl::CompileOptions m_compile_options;
    std::vector<std::string> m_shader_folders;
    std::string m_standard_shaders;
    Textures m_textures;
    std::shared_ptr<Ranges> m_ranges = std::make_shared<Ranges>();
    Transform m_render_from_world;
    scene::Options m_options;
    scene::Camera m_camera;
    std::optional<scene::ShaderRef> m_default_surface; // none: DefaultSurface
    WorldSpaces m_world_spaces;

    // Where the scene first names each shader: one message of it in all, whoever comes first.
    std::unordered_map<std::string, Location> m_first_named;

    std::vector<scene::ShaderRef> m_light_shaders;
    std::vector<scene::Light> m_lights;
    Digest m_facts_key;           // of what queries of options, and loops over lights, read
    bool m_gathers_light = false; // surfaces' loops that are no lobes run for the lights
    PointLights m_point_lights{[this] { return make_point_lights(); }};
    std::map<std::string, Spread> m_spread; // area lights by shaders of the scene
    Vec3f m_lit_middle{0, 0, 0};            // of what they light

    mutable std::mutex m_foreign_mutex;
    mutable std::set<std::string> m_foreign; // compiled shaders of other renderers, which were said to be so

    std::mutex m_mutex; // guards the maps below; nothing is compiled while it is held
    std::map<std::string, std::shared_future<Loaded>> m_shaders; // by path
    std::vector<std::unique_ptr<AirOfShader>> m_airs;            // numbered as they come, which nothing shows
    std::map<std::string, int> m_air_of;                         // by all that they depend on
    // By their keys; those of one key differ in what shaders read, while they were made, of where they stand.
    std::map<std::string, std::vector<std::shared_ptr<const MaterialCore>>> m_cores;
    std::map<std::pair<uint64_t, uint64_t>, std::shared_ptr<const Material>> m_materials;
};

} // namespace kanuka::shade
