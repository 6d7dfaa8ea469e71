// Shader and Instance behind sl.h.
#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <map>
#include <mutex>
#include <optional>

#include "sl/codegen/codegen.h"
#include "sl/ir/plan.h"
#include "sl/ops/runtime.h"
#include "sl/sl.h"

namespace kanuka::sl {

class FrontEnd;
struct Summary;

// One stage as it is compiled for a variant.
struct BuiltStage {
    ir::Stage stage;
    ir::Plan plan;
    StageFunction run = nullptr;
    explicit operator bool() const { return run != nullptr; }
};

// Machine code for one choice of what varies.
struct Build {
    ir::Variant variant;
    BuiltStage defaults, init, interior, displace, shade, light, filter;
    std::unique_ptr<NativeCode> code;
    bool from_cache = false;
    std::array<BuiltStage*, 7> stages() {
        return {&defaults, &init, &interior, &displace, &shade, &light, &filter};
    }
    std::array<const BuiltStage*, 7> stages() const {
        return {&defaults, &init, &interior, &displace, &shade, &light, &filter};
    }
};

// Infers, masks and plans a stage that is there, and adds it to what is to be compiled.
void prepare(BuiltStage& built, const ir::Stage& stage, const ir::Variant& variant, const std::string& symbol,
             int lanes, std::vector<StageToCompile>& list);
// 1, 8 or 16: what is asked for, as far as this machine runs it; 0 = the widest.
int usable_lanes(int lanes);

// The source of a shader, and its way to a Program, gone where and when it must be.
class ShaderSource {
  public:
    ShaderSource(std::string name, std::string text, CompileOptions options);
    ~ShaderSource();
    const std::string& name() const { return m_name; }
    // What messages and locations call it: nothing for a published one, whose files keep the names they had.
    const std::string& file() const { return m_file; }
    // Names the source in cache keys: equal for equal sources. Files that it includes are read for that.
    const std::string& identity();
    // Null if it does not compile; why is in messages().
    const ir::Program* program();
    std::vector<Journal::Entry> messages() const { return m_journal.entries(); }

  private:
    FrontEnd& front();
    std::string m_name, m_text, m_file, m_identity;
    CompileOptions m_options;
    Journal m_journal;
    std::unique_ptr<FrontEnd> m_front;
    std::unique_ptr<ir::Program> m_program;
    bool m_tried = false;
};

class ShaderImpl final : public Shader, public std::enable_shared_from_this<ShaderImpl> {
  public:
    // From the cache, else compiled. Messages go to the journal; null if there are errors.
    static std::shared_ptr<ShaderImpl> make(std::unique_ptr<ShaderSource> source, CompileOptions options,
                                            Journal& journal);

    const std::string& name() const override { return m_program->name; }
    ShaderKind kind() const override { return m_program->kind; }
    std::span<const Parameter> parameters() const override {
        return std::span(m_program->parameters)
            .first(m_program->parameters.size() - size_t(m_program->carried));
    }
    uint64_t hash() const override { return m_hash; }
    bool from_cache() const override { return m_from_cache; }
    bool queries() const override { return m_program->queries; }
    bool asks_for_interreflection() const override { return m_program->interreflection; }
    bool has_light_of_its_own() const override { return m_program->own_light; }
    CoShaderUse coshaders() const override { return m_program->coshaders; }
    std::span<const TextureUse> textures() const override { return m_program->textures; }
    std::vector<std::string> stages() const override;
    std::unique_ptr<Instance> instantiate(std::span<const Argument> arguments,
                                          Services& services) const override;

    const ir::Program& program() const { return *m_program; } // hollow, if it came from the cache
    int lanes() const { return m_options.lanes; }
    // Compiles at first use, unless the cache has it. Thread safe.
    const Build& build(const ir::Variant& variant) const;
    // Outputs of the shade stage that are uniform, for a variant.
    std::vector<bool> uniform_outputs(const ir::Variant& variant) const;
    // Has it been told that a loop of the shader does not end?
    std::atomic<bool>& endless() const { return m_endless; }

  private:
    ShaderImpl(std::unique_ptr<ShaderSource> source, CompileOptions options);
    std::string cache_key(const std::string& variant, bool first) const;
    bool load(Build& build, bool first, Summary& summary) const;
    void compile(Build& build, bool first, Journal* journal) const;

    CompileOptions m_options;
    std::shared_ptr<const ir::Program> m_program;
    uint64_t m_hash = 0;
    bool m_from_cache = false;
    mutable std::atomic<bool> m_endless{false};
    mutable std::mutex m_mutex;
    mutable std::unique_ptr<ShaderSource> m_source;
    mutable std::map<std::string, std::unique_ptr<Build>> m_builds;
    mutable std::map<std::string, std::vector<bool>> m_uniform;
};

class InstanceImpl final : public Instance {
  public:
    InstanceImpl(std::shared_ptr<const ShaderImpl> shader, std::span<const Argument> arguments,
                 Services& services);

    const Shader& shader() const override { return *m_shader; }
    const grid::LayeringProgram& program() const override { return m_layering; }
    bool displaces() const override { return m_shader->program().displace.root != nullptr; }
    grid::Reads reads_displacing() const override { return m_shader->program().displace.reads; }
    grid::Reads reads_shading() const override;
    void displace(grid::Grid& grid, const GridGlobals& globals, Services& services) const override;
    void shade(grid::Grid& grid, const GridGlobals& globals, Services& services,
               grid::VertexInputs& out) const override;
    Emission emit(grid::Grid& points, const GridGlobals& globals, Services& services) const override;
    Filtered filter(grid::Grid& points, const GridGlobals& globals, Services& services) const override;
    std::vector<std::string> aovs() const override;
    void shade_with_aovs(grid::Grid& grid, const GridGlobals& globals, Services& services,
                         grid::VertexInputs& out, std::vector<grid::SlotValues>& aovs) const override;
    bool uniform_material() const override { return m_uniform; }
    bool uniform_material(bool grids_have_colors) const override {
        return grids_have_colors ? m_uniform : m_uniform_plain;
    }
    bool emission_varies(bool grids_have_colors) const override {
        return grids_have_colors ? m_emission_varies : m_emission_varies_plain;
    }

  private:
    struct GridInputs;
    void bind(std::span<const Argument> arguments, Services& services);
    void set_defaults();
    void set_texts(const ir::Place& place, const std::vector<std::string>& values);
    void set_floats(const ir::Place& place, const std::vector<float>& values);
    std::string bind_parameter(const Argument& argument, size_t index);
    void run_once(const BuiltStage& stage, Services& services, ops::MaterialBuild* build);
    void build_material(const ops::MaterialBuild& build, Services& services);
    int node_of(const ops::MaterialBuild& build, const std::string& name, std::vector<int>& made, int depth,
                Services& services);
    int add_slot(grid::Slot slot, int channel, Vec3f value);
    Location place_of(const ops::MaterialBuild::Node& node) const;
    void check_layer(const ops::MaterialBuild::Node& n, const grid::LayerNode& node,
                     Services& services) const;
    void check_emission(const ops::MaterialBuild::Node& n, Services& services) const;
    std::vector<int> channels_of(const ops::MaterialBuild::Node& n, Services& services) const;
    void warn_unmade(const ops::MaterialBuild& build, Services& services) const;
    std::vector<int> make_roots(const ops::MaterialBuild& build, Services& services);
    void add_surface_slots();
    void find_uniform();
    bool colors_opacity(const ir::Channel& channel) const;
    void settle_presence(Services& services);
    void shade(grid::Grid& grid, const GridGlobals& globals, Services& services, grid::VertexInputs& out,
               std::vector<grid::SlotValues>* aovs) const;
    void keep_in_range(grid::VertexInputs& out, size_t vertices, size_t own, Services& services) const;
    void carry_members(grid::Grid& grid, const GridGlobals& globals, Services& services) const;
    ir::Variant variant_for(const grid::Grid& grid) const;
    GridInputs inputs_of(const grid::Grid& grid, const GridGlobals& globals,
                         const ir::Variant& variant) const;
    void call(const BuiltStage& stage, Frame& frame, ops::Runner& runner) const;
    void run(const BuiltStage& stage, const ir::Variant& variant, grid::Grid& grid,
             const GridGlobals& globals, Services& services, const std::vector<float*>& outputs) const;

    std::vector<std::vector<float>> run_whole(const BuiltStage& built, const ir::Variant& variant,
                                              grid::Grid& points, const GridGlobals& globals,
                                              Services& services) const;

    struct SlotSource {
        int output = -1; // of the shade stage
        Vec3f value{0, 0, 0};
    };
    std::shared_ptr<const ShaderImpl> m_shader;
    std::vector<float> m_params, m_members, m_channels;
    std::deque<std::string> m_texts; // what the pointers below point at
    std::vector<const char*> m_param_texts, m_member_texts;
    ir::Variant m_variant; // parameters bound to primvars
    std::vector<std::string> m_primvars;
    grid::LayeringProgram m_layering;
    std::vector<SlotSource> m_sources; // parallel to the slots
    std::optional<Vec3f> m_opacity;    // Os, where the arguments fix it
    bool m_uniform = false, m_uniform_plain = false, m_emission_varies = false,
         m_emission_varies_plain = false;
};

} // namespace kanuka::sl
