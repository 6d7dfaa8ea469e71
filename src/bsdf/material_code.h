// The layering program of a material, flattened for lanes.
#pragma once

#include <stdexcept>
#include <vector>

#include "bsdf/thick_coat.h"
#include "grid/word_layout.h"

namespace kanuka::bsdf {

inline constexpr int MaxNodes = 32, MaxLobes = 16;

// The layering program, flattened for lanes. Host data, one per program, read by every hit.
struct MaterialCode {
    // What slot tables, inputs, positions and indices of its shapes are offsets into, all of them: a window
    // of the micropolygon store. Null = it has no shapes.
    const uint32_t* page_words = nullptr;
    const float* page_floats() const { return reinterpret_cast<const float*>(page_words); }

    // What may absorb, or refract, as an upper layer.
    static constexpr LobeId Coat = LobeId::MicrofacetDielectricBrdf;

    struct Place {
        int word = -1, half = 0; // -1: not given, `fallback` holds
        bool wide = false;       // a colour without upper bound
        grid::Between between = grid::Between::Linear;
        // What instances may change: nothing (what the tracer reads, too), or which variant it is of; of
        // inputs of lobes more.
        enum class Varies : uint8_t { No, ByVariant, Tinted, Rougher } varies = Varies::No;
        Vec3f fallback{0, 0, 0};
    };
    struct Node {
        grid::LayerOp op;
        LobeId lobe;
        int upper, lower;
        int leaf = -1; // number of the lobe among those that scatter; -1 for operators and emission
        Place weight;
        Place inputs[grid::MostInputs];
        int input_count = 0;
        uint32_t given = 0, colors = 0, numbers = 0; // bits by input: given at all; colours; floats
        bool need_albedo = false;                    // below the upper side of a coat
        int absorber = -1; // coats: leaf of the upper layer, if it absorbs what crosses it
        int bed = -1;      // below which thick coat; -1 = none
    };
    // What lies below a thick coat.
    struct Bed {
        int outer; // the bed that the coat lies in; -1 = none
        int node;  // the coat
        int upper; // leaf of its layer
    };
    struct Aov {
        int channel; // the first of its values among all
        int components;
        Place places[3];
    };
    struct LitBy {
        int light;
        Place amount;
    };
    std::vector<Node> nodes; // post-order
    std::vector<LitBy> lit_by;
    Place presence;        // word -1 = it is all there
    Place opacity[3];      // likewise: the same as presence
    Place ambient;         // likewise: as much as it reflects
    int air = -1;          // LayeringProgram::air
    std::vector<Bed> beds; // outer before inner; most materials have none
    int bed_of_leaf[MaxLobes] = {};
    std::vector<Aov> aovs;
    int leaves = 0;
    int words = 0; // of a vertex record; the normal's table entry follows
    int variants = 1;
    // Of a slot table, where the words of a variant begin.
    int first_entry(int variant) const { return variant == 0 ? 0 : variant * words + (has_tangent ? 2 : 1); }
    bool dispersive = false, transmits = false, has_coat = false;
    bool has_tangent = false; // its table entry follows the normal's
    bool absorbs = false;     // a coat takes from what crosses it
    // Bits by leaf: thin walls, which let light go on as it came where they are smooth.
    uint32_t straight = 0;
    uint32_t aimed = 0;   // lobes of one direction
    uint32_t turned = 0;  // lobes that have a normal of their own
    uint32_t diffuse = 0; // lobes that scatter to all sides: to light path expressions, what is not glossy

    explicit MaterialCode(const grid::LayeringProgram& program, const uint32_t* page_words = nullptr)
        : page_words(page_words) {
        const grid::WordLayout layout(program);
        words = int(layout.words.size());
        has_tangent = program.needs_tangent();
        variants = program.variants;
        for (const grid::LayerNode& n : program.nodes)
            add_node(program, layout, n);
        if (nodes.size() > size_t(MaxNodes) || leaves > MaxLobes)
            throw std::length_error("a material has more than 16 lobes or 32 nodes");
        add_shown(program, layout);
        if (has_coat && leaves > 1)
            make_beds(int(nodes.size()) - 1, -1);
        mark_leaves();
        mark_coats();
    }

    // Of its own, of a lobe that may have one; null = none may.
    static const Place* normal_of(const Node& lobe) {
        for (int i = 0; i < lobe.input_count; i++)
            if (grid::lobe(lobe.lobe).inputs[size_t(i)].type == grid::InputType::Normal)
                return &lobe.inputs[i];
        return nullptr;
    }
    bool below(int bed, int coat) const { // is a bed that of a coat, or within it?
        while (bed >= 0 && bed != coat)
            bed = beds[size_t(bed)].outer;
        return bed == coat;
    }

  private:
    static Place place_of(const grid::LayeringProgram& program, const grid::WordLayout& layout, int slot,
                          Vec3f fallback) {
        Place p;
        p.fallback = fallback;
        if (slot >= 0)
            p.word = layout.places[size_t(slot)].word, p.half = layout.places[size_t(slot)].half,
            p.between = program.slots[size_t(slot)].between;
        return p;
    }
    void add_node(const grid::LayeringProgram& program, const grid::WordLayout& layout,
                  const grid::LayerNode& n) {
        Node node{n.op, n.lobe, n.upper, n.lower};
        using Varies = Place::Varies;
        node.weight = place_of(program, layout, n.weight, Vec3f(1, 1, 1));
        node.weight.varies = Varies::ByVariant;
        if (n.op == grid::LayerOp::Lobe) {
            const grid::LobeDecl& decl = grid::lobe(n.lobe);
            node.input_count = int(decl.inputs.size());
            for (size_t i = 0; i < decl.inputs.size(); i++) {
                node.inputs[i] = place_of(program, layout, i < n.inputs.size() ? n.inputs[i] : -1,
                                          decl.inputs[i].fallback);
                node.inputs[i].varies = decl.inputs[i].body                  ? Varies::Tinted
                                        : decl.inputs[i].name == "roughness" ? Varies::Rougher
                                                                             : Varies::ByVariant;
                node.inputs[i].wide = decl.inputs[i].storage == grid::Storage::Amount;
                node.given |= uint32_t(node.inputs[i].word >= 0) << i;
                node.colors |= uint32_t(decl.inputs[i].type == grid::InputType::Color) << i;
                node.numbers |= uint32_t(decl.inputs[i].type == grid::InputType::Float) << i;
            }
            const bool scatters = decl.kind != grid::LobeKind::Emission && decl.kind != grid::LobeKind::Phase;
            node.leaf = scatters ? leaves++ : -1;
            transmits |= decl.kind == grid::LobeKind::Transmission ||
                         decl.kind == grid::LobeKind::ReflectionTransmission;
            dispersive |= n.lobe == LobeId::GratingBrdf ||
                          (n.lobe == LobeId::MicrosurfaceDielectricBsdfRgb_v1 &&
                           node.given >> input_of(LobeId::MicrosurfaceDielectricBsdfRgb_v1, "abbe") & 1);
        }
        has_coat |= n.op == grid::LayerOp::Coat || n.op == grid::LayerOp::Thick;
        nodes.push_back(node);
    }
    // All but the lobes.
    void add_shown(const grid::LayeringProgram& program, const grid::WordLayout& layout) {
        const auto place = [&](int slot, Vec3f fallback) {
            return place_of(program, layout, slot, fallback);
        };
        presence = place(program.presence, Vec3f(1, 1, 1));
        for (size_t c = 0; c < 3; c++)
            opacity[c] = place(program.opacity[c], Vec3f(1, 1, 1));
        air = program.air;
        ambient = place(program.ambient, Vec3f(0, 0, 0));
        ambient.varies = Place::Varies::Tinted;
        for (const grid::LitBy& l : program.lit_by) {
            lit_by.push_back({l.light, place(l.slot, Vec3f(0, 0, 0))});
            lit_by.back().amount.varies = Place::Varies::ByVariant;
        }
        for (const grid::Aov& a : program.aovs) {
            Aov aov{3 * a.index, a.components, {}};
            for (int c = 0; c < a.components; c++) {
                aov.places[c] = place(a.slots[size_t(c)], Vec3f(0, 0, 0));
                aov.places[c].varies = Place::Varies::ByVariant;
            }
            aovs.push_back(aov);
        }
    }
    void mark_leaves() {
        for (const Node& n : nodes) {
            if (n.leaf < 0)
                continue;
            bed_of_leaf[n.leaf] = n.bed;
            if (n.bed < 0 && n.lobe == LobeId::ThinWalledDielectricBsdf)
                straight |= 1u << n.leaf;
            if (n.lobe == LobeId::AimedBsdf)
                aimed |= 1u << n.leaf;
            if (const Place* normal = normal_of(n); normal && normal->word >= 0)
                turned |= 1u << n.leaf;
            if (is_diffuse(n.lobe) || n.lobe == LobeId::LambertBtdf)
                diffuse |= 1u << n.leaf;
        }
    }
    void mark_coats() {
        for (Node& n : nodes) {
            if (n.op != grid::LayerOp::Thick && n.op != grid::LayerOp::Coat)
                continue;
            mark_albedo(n.upper);
            const Node& upper = nodes[size_t(n.upper)];
            if (n.op == grid::LayerOp::Coat && upper.op == grid::LayerOp::Lobe && upper.lobe == Coat &&
                (upper.given &
                 (1u << input_of(Coat, "transmittance") | 1u << input_of(Coat, "absorption")))) {
                n.absorber = upper.leaf;
                absorbs = true;
            }
        }
    }
    // Thick coats that are not dielectrics, and those too deep, are coats without refraction.
    void make_beds(int node, int bed) {
        Node& n = nodes[size_t(node)];
        n.bed = bed;
        if (n.op == grid::LayerOp::Lobe)
            return;
        make_beds(n.upper, bed);
        if (n.op == grid::LayerOp::Thick) {
            const Node& upper = nodes[size_t(n.upper)];
            if (upper.op == grid::LayerOp::Lobe && upper.lobe == LobeId::MicrofacetDielectricBrdf &&
                beds.size() < MaxThickCoats) {
                beds.push_back({bed, node, upper.leaf});
                bed = int(beds.size()) - 1;
            } else {
                n.op = grid::LayerOp::Coat;
            }
        }
        make_beds(n.lower, bed);
    }
    void mark_albedo(int node) {
        Node& n = nodes[size_t(node)];
        n.need_albedo = true;
        if (n.op != grid::LayerOp::Lobe) {
            mark_albedo(n.upper);
            mark_albedo(n.lower);
        }
    }
};

} // namespace kanuka::bsdf
