#include "shade/default_surface.h"

#include "grid/lobe_table.h"
#include "shade/opacity.h"

namespace kanuka::shade {

namespace {

class DefaultShader final : public sl::Shader {
  public:
    const std::string& name() const override { return m_name; }
    sl::ShaderKind kind() const override { return sl::ShaderKind::Surface; }
    std::span<const sl::Parameter> parameters() const override { return {}; }
    uint64_t hash() const override { return 1; } // raise when what it computes changes
    bool from_cache() const override { return true; }
    std::unique_ptr<sl::Instance> instantiate(std::span<const sl::Argument>, sl::Services&) const override {
        return make_default_surface({});
    }

  private:
    std::string m_name = "matte";
};

class DefaultInstance final : public sl::Instance {
  public:
    explicit DefaultInstance(const DefaultSurface& kind) : m_kind(kind) {
        grid::LayerNode leaf;
        constexpr int Reflectance = grid::input_of(grid::LobeId::LambertBrdf, "diffuseReflectance");
        leaf.lobe = grid::LobeId::LambertBrdf;
        leaf.name = "diffuse";
        leaf.inputs.assign(grid::lobe(leaf.lobe).inputs.size(), -1);
        leaf.inputs[Reflectance] = 0;
        m_program.nodes.push_back(leaf);
        const grid::LobeInput& input = grid::lobe(leaf.lobe).inputs[Reflectance];
        m_program.slots.push_back({input.type, input.storage, input.low, input.high, !kind.varying_color,
                                   leaf.name + "." + std::string(input.name)});
        if (kind.has_presence)
            m_program.presence = add_presence_slot(m_program, !kind.varying_presence);
    }
    const sl::Shader& shader() const override { return m_shader; }
    const grid::LayeringProgram& program() const override { return m_program; }
    bool displaces() const override { return false; }
    void displace(grid::Grid&, const sl::GridGlobals&, sl::Services&) const override {}
    bool uniform_material() const override { return !m_kind.varying_color && !m_kind.varying_presence; }
    bool uniform_material(bool) const override { return uniform_material(); }
    bool emission_varies(bool) const override { return false; }

    void shade(grid::Grid& grid, const sl::GridGlobals& globals, sl::Services&,
               grid::VertexInputs& out) const override {
        out.stride = grid.stride;
        out.slots.resize(m_program.slots.size());
        fill_color(grid, "Cs", globals.Cs, out.slots[0]);
        if (m_program.presence >= 0)
            fill_presence(grid, globals.Os, out.slots[size_t(m_program.presence)]);
    }

  private:
    DefaultSurface m_kind;
    DefaultShader m_shader;
    grid::LayeringProgram m_program;
};

} // namespace

std::unique_ptr<sl::Instance> make_default_surface(const DefaultSurface& kind) {
    return std::make_unique<DefaultInstance>(kind);
}

} // namespace kanuka::shade
