#include "shade/variants.h"

#include <algorithm>
#include <utility>

#include "base/digest.h"

namespace kanuka::shade {

namespace {

class VariedMaterial final : public Material {
  public:
    explicit VariedMaterial(std::vector<std::shared_ptr<const Material>> variants)
        : m_variants(std::move(variants)), m_program(first().program()) {
        m_program.variants = int(m_variants.size());
    }
    const grid::LayeringProgram& program() const override { return m_program; }
    bool displaces() const override { return first().displaces(); }
    bool emission_varies() const override { return first().emission_varies(); }
    grid::Reads reads_displacing() const override { return first().reads_displacing(); }
    grid::Reads reads_shading() const override {
        grid::Reads all = first().reads_shading();
        for (const auto& variant : m_variants) {
            const grid::Reads r = variant->reads_shading();
            all = both(all, r, std::max(all.rings, r.rings));
        }
        return all;
    }
    bool uniform() const override {
        return std::ranges::all_of(m_variants, [](const auto& variant) { return variant->uniform(); });
    }
    uint64_t hash() const override {
        Digester d;
        for (const auto& variant : m_variants)
            d(variant->hash());
        return d.digest().low;
    }
    SpacesRead reads_spaces() const override {
        SpacesRead read;
        for (const auto& variant : m_variants)
            read.add(variant->reads_spaces());
        return read;
    }
    Digest digest_of(const SpacesRead& read) const override { return first().digest_of(read); }
    using Material::displace, Material::shade;
    void displace(grid::Grid& grid, SpacesLog* log) const override { first().displace(grid, log); }
    void shade(grid::Grid& grid, grid::VertexInputs& out, SpacesLog* log) const override {
        out.variants.clear();
        for (size_t k = 1; k < m_variants.size(); k++) {
            grid::Grid copy = grid; // shading may turn normals
            grid::VertexInputs inputs;
            m_variants[k]->shade(copy, inputs, log);
            out.variants.push_back(std::move(inputs.slots));
        }
        first().shade(grid, out, log);
    }

  private:
    const Material& first() const { return *m_variants[0]; }

    const std::vector<std::shared_ptr<const Material>> m_variants;
    grid::LayeringProgram m_program;
};

} // namespace

scene::Primitive with_variant(const scene::Primitive& primitive, int variant) {
    scene::Primitive one = primitive;
    scene::Value value;
    value.name = "variant";
    value.type = scene::Type::Float;
    value.detail = scene::Detail::Constant;
    value.floats = std::vector<float>{float(variant)};
    one.primvars.set(std::move(value));
    return one;
}

std::shared_ptr<const Material> make_variants(const scene::Primitive& primitive,
                                              std::vector<std::shared_ptr<const Material>> materials,
                                              Journal& journal) {
    if (std::ranges::all_of(materials, [&](const auto& each) { return each == materials[0]; }))
        return materials[0]; // no shader asks which it is
    const std::string layers = materials[0]->program().key();
    size_t others = 0;
    for (std::shared_ptr<const Material>& variant : materials)
        if (variant->program().key() != layers) {
            variant = materials[0];
            others++;
        }
    if (others > 0)
        journal.warning(
            primitive.where,
            std::to_string(others) +
                " variants have other layers than the first and are shown as that one: weights of "
                "lobes may depend on \"variant\", and which lobes there are may not");
    return std::make_shared<VariedMaterial>(std::move(materials));
}

} // namespace kanuka::shade
