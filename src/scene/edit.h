// Edits of a scene, and what a run of them came to.
#pragma once

#include <map>
#include <set>
#include <variant>

#include "scene/scene.h"
#include "scene/schema/parameter.h"

namespace kanuka::scene {

// What of a node can change by itself. Parameters: those of its shaders, or of a light or camera.
enum class Aspect : uint8_t { Geometry, Primvars, Placement, Attributes, Links, Parameters, Options };

struct Aspects {
    uint8_t bits = 0;
    constexpr Aspects() = default;
    constexpr Aspects(Aspect one) : bits(uint8_t(1u << uint8_t(one))) {}
    constexpr bool has(Aspect one) const { return bits >> uint8_t(one) & 1; }
    constexpr bool operator==(const Aspects&) const = default;
    constexpr Aspects& operator|=(Aspects more) {
        bits = uint8_t(bits | more.bits);
        return *this;
    }
    friend constexpr Aspects operator|(Aspects a, Aspects b) { return a |= b; }
};
constexpr Aspects operator|(Aspect a, Aspect b) {
    return Aspects(a) | Aspects(b);
}
inline constexpr Aspects EveryAspect = Aspect::Geometry | Aspect::Primvars | Aspect::Placement |
                                       Aspect::Attributes | Aspect::Links | Aspect::Parameters;

// ---- edits --------------------------------------------------------------------------------------------

// A node that has an id keeps it: one that was removed comes back as what it was.
struct Add {
    NodeId parent = NodeId::World; // or a group, for primitives and instances
    std::variant<Primitive, Group, Group::Instances, Light, ShaderRef, Solid> node; // ShaderRef: a light
};
// All or none of them. A group goes with all that is in it, and not while it is placed.
struct Remove {
    std::vector<NodeId> ids;
};
// By rows of the schema: options of the world, attributes of a primitive, parameters of lights and cameras.
struct Set {
    struct Assignment {
        std::string row;
        Setting value;
        bool operator==(const Assignment&) const = default;
    };
    NodeId id;
    std::vector<Assignment> values; // all or none
};
// Of a shader: of a primitive its slot ("surface", …), then handles of co-shaders; of the world "imager". Of
// a light by its shader nothing, then handles.
struct SetParameters {
    NodeId id;
    std::vector<std::string> shader;
    std::vector<Value> values; // all or none
};

struct Shape { // primitives
    Geometry geometry;
    ValueList primvars;
    std::vector<Motion::Shape> shapes = {}; // as in Motion
};
struct Placement { // primitives and lights, in the world or the group
    Transform transform;
    std::vector<TransformKey> keys = {}; // of one that moves
};
struct Places { // instances, as in Group::Instances
    Buffer<float> transforms;
    std::vector<double> times = {};
    std::optional<Variation> variation = {}; // none = as it was
};
struct Replace {
    NodeId id;
    std::variant<Shape, ValueList, Placement, Places, std::shared_ptr<const Attributes>, Camera> with;
};

using Edit = std::variant<Add, Remove, Set, SetParameters, Replace>;

// ---- what they came to --------------------------------------------------------------------------------

struct Delta {
    std::set<NodeId> added, removed;
    std::map<NodeId, Aspects> changed; // of what was there before and still is

    bool empty() const { return added.empty() && removed.empty() && changed.empty(); }
    void note_added(NodeId id) {
        if (removed.erase(id) > 0)
            changed[id] = EveryAspect;
        else
            added.insert(id);
    }
    void note_removed(NodeId id) {
        changed.erase(id);
        if (added.erase(id) == 0)
            removed.insert(id);
    }
    void note_changed(NodeId id, Aspects aspects) {
        if (!added.contains(id))
            changed[id] |= aspects;
    }
};

} // namespace kanuka::scene
