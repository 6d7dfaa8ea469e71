// Retained objects: ObjectBegin … ObjectEnd is recorded once, and becomes a Group for every attribute state
// that it is instanced under, since primitives inherit what they do not set themselves from the instance
// (RISpec 5.8).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "ingest/rib/reports.h"
#include "ingest/rib/state.h"
#include "scene/editor.h"
#include "scene/text_column.h"

namespace kanuka::ingest {

struct ObjectRecord {
    struct Member { // a primitive, or an instance of an earlier object
        scene::Primitive primitive;
        int object = -1; // >= 0: an instance; the primitive's transform and attributes are the instance's
        uint64_t set = 0;
    };
    struct Variant {
        std::shared_ptr<const scene::Attributes> attributes;
        int group;
    };
    std::string name;
    Location where;
    std::vector<Member> members;
    std::vector<scene::Solid> solids;
    std::vector<scene::ShaderRef> lights;           // that each instance brings, in the object's space
    int depth = 1;                                  // levels of objects, this one included
    std::unordered_multimap<size_t, Variant> looks; // by hash of the look
    std::map<const scene::Attributes*, Variant> by_pointer; // holds the pointers, so that they stay unique
};

// How an instance differs from others of its group: Attribute "instance" of its own. It is no part of its
// look.
struct InstanceDifference {
    std::optional<float> variant, roughness;
    std::optional<Rgb> tint;
    scene::ValueList primvars; // constant
    bool unique = false;
    bool in_looks() const { return variant || roughness || tint || !primvars.values.empty(); }
    std::string variables() const; // their declarations
};

// Attribute "instance:primvar" of an instance: a variable that surface shaders read. Whole numbers are
// floats.
constexpr std::string_view InstancePrimvar = "instance:primvar:";
scene::Value instance_primvar(const scene::Value& given);

// Matrices of instances by group and times (none = still), instance by instance, each at all of its times.
struct InstanceLists {
    struct List {
        std::vector<float> matrices;
        size_t count = 0;
        std::vector<float> variant, tint, roughness; // up to the last that has one
        std::vector<scene::Value> primvars;          // as they are declared
        std::vector<std::vector<float>> values;      // of each of these,
        std::vector<scene::TextColumn> texts;        // and its texts
    };
    // By group, times, whether they are unique, whether they say any of that (others take what is around
    // them), and which variables.
    std::map<std::tuple<int, std::vector<double>, bool, bool, std::string>, List> lists;
    void add(int group, const Transform& still, const std::vector<TransformKey>& moving,
             const InstanceDifference& difference);
    // Ids go on from `next_id`, which comes out behind the last.
    std::vector<scene::Group::Instances> take(int& next_id);
};

class Objects {
  public:
    // Index of the record; the handle means it from now on.
    int begin(const std::string& handle, const Location& where);
    void end(int object);                      // from here on it can be instanced
    int find(const std::string& handle) const; // -1 = unknown or not ended
    static constexpr int MaxDepth = 64;        // of objects in objects
    ObjectRecord& record(int object) { return m_records[size_t(object)]; }

    // One more instance in the world.
    void instance(const scene::Scene& scene, scene::Editor& editor, int object,
                  const std::shared_ptr<const scene::Attributes>& attributes,
                  const Transform& world_from_object, const std::vector<TransformKey>& moving);
    // Writes the instances to the scene; ids go on from `next_id`, and where they end is returned. The next
    // scene's groups are numbered on from this one's.
    int finish(const scene::Scene& scene, scene::Editor& editor, int next_id);
    int groups_before() const { return m_groups_before; }
    void forget_groups(); // another scene begins, with groups of its own; the objects stay

  private:
    int group_for(const scene::Scene& scene, scene::Editor& editor, int object,
                  const std::shared_ptr<const scene::Attributes>& attributes,
                  const Transform& world_from_object);
    // Takes out what makes an instance differ.
    InstanceDifference difference_of(std::shared_ptr<const scene::Attributes>& attributes);
    std::vector<ObjectRecord> m_records;
    std::shared_ptr<const scene::Attributes> m_plain; // what was left of the last ones: often alike
    std::map<std::string, int> m_handles;
    InstanceLists m_instances;
    int m_groups_before = 0; // of scenes that this one goes on from
};

// What a primitive inside an object looks like: `own` where its bits are set, else `inherited`.
std::shared_ptr<const scene::Attributes> inherit(const std::shared_ptr<const scene::Attributes>& inherited,
                                                 const std::shared_ptr<const scene::Attributes>& own,
                                                 uint64_t set);

} // namespace kanuka::ingest
