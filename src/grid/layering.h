// Layering programs: which lobes a material has and how they layer. Data, fixed once a primitive by mnk_init;
// the lobes' inputs are computed at every vertex. This is the contract between compiler, store, CPU and GPU
// transport and preview.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "grid/lobe_schema.h"

namespace kanuka::grid {

inline constexpr int LayeringVersion = 1;

// Upper and lower refer to the operator's two children; w is the operator's weight at the vertex.
enum class LayerOp : uint8_t {
    Lobe,  // a leaf: lobe weight times lobe
    Mix,   // w upper + (1 - w) lower
    Over,  // w upper + (1 - w * coverage) lower, coverage = sum of the upper's lobe weights, at most 1
    Coat,  // w upper + lower attenuated by the remaining albedo of the upper, 1 - w * albedo(upper, wo)
    Add,   // upper + lower, weights unchanged: emission only
    Thick, // as Coat, lower seen along directions that the upper, a dielectric, refracts; with what is
           // reflected back inside
};

struct LayerNode {
    LayerOp op = LayerOp::Lobe;
    LobeId lobe = LobeId::LambertBrdf; // leaves
    std::string name;                  // as the shader named it
    int upper = -1, lower = -1;        // children: indices of earlier nodes
    int weight = -1;                   // slot of the weight; -1 = one
    std::vector<int> inputs; // leaves: slot of each input of the lobe, in schema order; -1 = its default
};

// A value the shader computes at every vertex (or once, if uniform).
struct Slot {
    InputType type = InputType::Float;
    Storage storage = Storage::Half;
    float low = 0, high = 1;
    bool uniform = false; // the shader computes one value a grid
    std::string name;     // "reflection.diffuseReflectance", for messages
    Between between = Between::Linear;
};

// What is inside, the same everywhere; fixed once a primitive by mnk_init and mnk_interior.
struct Interior {
    static constexpr int MaxPhaseInputs = 4;
    float ior = 1.5f;
    float priority = 0;                           // where interiors overlap, the highest is what is there
    Rgb absorption{0, 0, 0}, scattering{0, 0, 0}; // 1/m
    LobeId phase = LobeId::HenyeyGreensteinPfrgb;
    std::array<float, MaxPhaseInputs> phase_inputs{}; // in schema order; of colours the mean

    // The inputs of a phase function as they are declared.
    static std::array<float, MaxPhaseInputs> defaults(LobeId phase);
};

// An output parameter of the shader that a display asks for: floats, one slot a component.
struct Aov {
    int index = 0;      // among those that were asked for
    bool color = false; // filtered like one; else a mean over what was hit
    std::array<int, 3> slots{-1, -1, -1};
    int components = 1;
};

// What it shines with because a light that casts shadows lights it: a loop over lights that is no lobe's.
struct LitBy {
    int light = 0; // of those that shine from one place
    int slot = -1; // amount, a colour
};

// Nodes in post-order; the last is the root. A material without layers is all leaves joined under implicit
// Add nodes, their weights as given: SetLobe(boundary, "reflection", 0.25, …) and 0.75 of transmission is
// 0.25 a + 0.75 b.
struct LayeringProgram {
    std::vector<LayerNode> nodes;
    std::vector<Slot> slots;
    int presence = -1; // slot of presence (cut-out opacity), float; -1 = opaque
    // Slots of Oi's components, floats, where what stops light is not the same for all colours: what is seen
    // of the surface and what passes it are coloured by them. -1 = presence is all there is to it.
    std::array<int, 3> opacity{-1, -1, -1};
    int ambient = -1; // slot of how much of ambient light it shows, colour; -1 = as much as it reflects
    int air = -1;     // between it and who sees it, by number (ways.h); -1 = nothing
    float emission_cosine = 0; // an area light shines where the cosine to its normal is at least this
    bool shines_both = false;  // to both sides, as Ci does; lobes and area lights shine to the outside
    std::vector<Aov> aovs;
    std::vector<LitBy> lit_by;
    std::optional<Interior> interior;
    int variants = 1; // times that the surface is shaded, for instances to show or blend; see VertexInputs

    bool emits() const;
    // Its first emission lobe, after which all of its emission is shaped; null = none.
    const LayerNode* emission() const;
    // Does its light depend on the angle to the normal?
    bool emits_along_normals() const;
    // Does what is emitted depend on a slot with that property?
    bool emission_depends_on(const std::function<bool(int slot)>& property) const;
    // Does it let light through, by presence, a lobe, or what is inside?
    bool lets_through() const;
    // Has its surface two sides but nothing between them, so that a fibre of it is passed in one step? It
    // lets light through, and no lobe is the border of something that refracts.
    bool is_layer() const;
    bool needs_tangent() const; // a lobe has a direction on the surface: the record holds that of dPdu
    std::string key() const;    // two materials with the same key run the same code on the same record
};

// What shading hands to the store for one grid: for each slot, an array of `vertices` values (SoA, 3
// components for colours, stride as in the Grid), or one value if the slot is uniform. The shading normal
// travels beside them.
struct SlotValues {
    bool uniform = false;
    Vec3f value{0, 0, 0};    // if uniform
    std::vector<float> data; // else components * stride floats
};

struct VertexInputs {
    int stride = 0;
    std::vector<SlotValues> slots; // parallel to LayeringProgram::slots
    // Of what is shaded several times, all but the first: its lobes' inputs differ, and nothing else.
    std::vector<std::vector<SlotValues>> variants;
};

} // namespace kanuka::grid
