// The graphics state of RISpec chapter 4: options, attributes, transformation, and the blocks that save them.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "scene/scene.h"
#include "scene/schema/attributes.h"

namespace kanuka::ingest {

// What Camera saves.
struct NamedCamera {
    scene::Camera camera;
    std::optional<float> frame_aspect_ratio;
    Transform camera_from_world;
    std::vector<TransformKey> keys; // of a moving one
    std::vector<float> shutter_opening;
};

struct OptionState {
    OptionState() { options.transport = scene::Options::Transport::Auto; }
    scene::Options options;
    scene::Camera camera; // its matrix is set by WorldBegin
    std::optional<float> frame_aspect_ratio;
    float relative_detail = 1;
    // ColorSamples: colours have n components; Rgb = row vector * rgb_from_samples (n x 3). Empty = plain
    // RGB.
    std::vector<float> rgb_from_samples;
    bool shutter_given = false;
    std::map<std::string, NamedCamera> cameras;
};

// Which attributes were set since ObjectBegin: the others come from the instance (RISpec 5.8). Those that
// scene/schema/attributes.cpp declares have the bits behind these, see bit_of().
enum AttributeField : uint64_t {
    FieldColor = 1u << 0,
    FieldOpacity = 1u << 1,
    FieldShadingRate = 1u << 2,
    FieldSides = 1u << 3,
    FieldOrientation = 1u << 4,
    FieldMatte = 1u << 5,
    FieldSurface = 1u << 6,
    FieldDisplacement = 1u << 7,
    FieldInterior = 1u << 8,
    FieldExterior = 1u << 9,
    FieldAtmosphere = 1u << 10,
    FieldAreaLight = 1u << 11,
    FieldTextureCoordinates = 1u << 12,
    FieldUser = 1u << 13,
    FieldToggleOrientation = 1u << 14, // ReverseOrientation without Orientation
    FieldCoShaders = 1u << 15,
};
inline uint64_t bit_of(const scene::AttributeParameter& row) {
    return uint64_t(1) << (16 + (&row - scene::attribute_parameters().data()));
}

using LightSet = std::set<int>; // indices of lights that are on

struct AttributeState {
    // Copied when written while somebody else holds it, so that primitives and blocks share one.
    std::shared_ptr<scene::Attributes> shared = std::make_shared<scene::Attributes>();
    uint64_t set = 0; // bits: AttributeField, bit_of()
    std::shared_ptr<const LightSet> lights = std::make_shared<LightSet>();
    Shared<scene::Basis> u_basis = scene::basis_by_name("bezier"), v_basis = scene::basis_by_name("bezier");
    std::optional<Bounds3f> detail_bound;          // of Detail, in the space it was given in
    Transform detail_transform;                    // that space
    bool detail_visible = true;                    // DetailRange's verdict
    std::shared_ptr<const scene::TrimCurves> trim; // of NuPatches to come
    int solid = -1;                                // of an open SolidBegin, among Context::solids()

    scene::Attributes& edit(uint64_t field) {
        if (shared.use_count() > 1)
            shared = std::make_shared<scene::Attributes>(*shared);
        set |= field;
        return *shared;
    }
    // What the schema calls `name`.
    scene::Attributes& edit(std::string_view name) { return edit(bit_of(*scene::find_attribute(name))); }
};

enum class BlockKind : uint8_t { Frame, World, Attribute, Transform, Solid, Object, Motion };
std::string_view begin_name(BlockKind kind); // "AttributeBegin", …

struct Block {
    BlockKind kind;
    Location where;
    AttributeState attributes;
    Transform ctm;
    std::vector<TransformKey> ctm_keys;
    std::unique_ptr<OptionState> options; // frames and worlds
};

} // namespace kanuka::ingest
