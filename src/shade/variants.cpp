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
        for (const auto& variant : m_variants)
            m_like.push_back(size_t(std::ranges::find(m_variants, variant) - m_variants.begin()));
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
        out.variants.assign(m_variants.size() - 1, {});
        for (size_t k = 1; k < m_variants.size(); k++) {
            if (m_like[k] < k)
                continue;
            grid::Grid copy = grid; // shading may turn normals
            grid::VertexInputs inputs;
            m_variants[k]->shade(copy, inputs, log);
            out.variants[k - 1] = std::move(inputs.slots);
        }
        first().shade(grid, out, log);
        for (size_t k = 1; k < m_variants.size(); k++)
            if (m_like[k] < k)
                out.variants[k - 1] = m_like[k] == 0 ? out.slots : out.variants[m_like[k] - 1];
    }

  private:
    const Material& first() const { return *m_variants[0]; }

    const std::vector<std::shared_ptr<const Material>> m_variants;
    std::vector<size_t> m_like; // the first that is the same: what a shader does not read changes nothing
    grid::LayeringProgram m_program;
};

} // namespace

scene::Primitive with_variant(const scene::Primitive& primitive, float variant) {
    scene::Primitive one = primitive;
    scene::Value value;
    value.name = "variant";
    value.type = scene::Type::Float;
    value.detail = scene::Detail::Constant;
    value.floats = std::vector<float>{variant};
    one.primvars.set(std::move(value));
    return one;
}

scene::Primitive with_variables(const scene::Primitive& primitive, const scene::ValueList& variables) {
    const bool has_variants = primitive.attributes && primitive.attributes->variants > 1;
    scene::Primitive one =
        has_variants ? with_variant(primitive, variables.get_float("variant", 0)) : primitive;
    for (const scene::Value& value : variables.values)
        if (value.name != "variant" && !primitive.primvars.find(value.name))
            one.primvars.set(value);
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
                "lobes may depend on \"variant\" and on variables of instances, and which lobes there are "
                "may not");
    return std::make_shared<VariedMaterial>(std::move(materials));
}

} // namespace kanuka::shade
