// The one way that scenes are changed: readers of files, the C binding and Python add what they read through
// it, and whoever changes what is there hands it edits.
#pragma once

#include <optional>
#include <unordered_map>

#include "scene/edit.h"
#include "scene/node_index.h"

namespace kanuka::scene {

// Why an edit cannot be, with what would do; nothing = it can.
using Fault = std::optional<std::string>;

struct Outcome {
    NodeId id = NodeId::None; // what was added or changed
    std::string refusal;      // empty = it is done; else nothing was changed
};

// Thread safety: none. While it lives, it alone adds to the scene and takes from it. What attributes and
// buffers hold is never changed in place: copies of nodes share them, and stay as they were.
class Editor {
  public:
    // `first_group`: the number of the scene's first, where it goes on from another.
    explicit Editor(Scene& scene, int first_group = 0)
        : Editor(scene, scene.options, scene.camera, first_group) {}
    // Options and camera may lie elsewhere: those of the next picture, while one is made of the scene.
    Editor(Scene& scene, Options& options, Camera& camera, int first_group = 0);

    // ---- edits
    Outcome apply(Edit edit);
    // Notes what edits and additions come to from here on; null = no more.
    void record(Delta* delta) { m_delta = delta; }
    // Other scenes number their groups on from this one's: edits add none and remove none.
    void keep_groups() { m_keeps_groups = true; }
    // What stands in for light shaders that are not found, where that is known: it is chosen again when their
    // parameters change, and for those that come without.
    using StandInFor = std::shared_ptr<const ShaderRef::StandIn> (*)(const ShaderRef& light);
    void choose_stand_ins(StandInFor choose) { m_stand_in_for = choose; }

    // ---- finding
    // What has an id of its own; null = there is no such node, or it is another kind.
    template <class Node>
    const Node* get(NodeId id) const {
        return at<Node>(id);
    }
    // Of a node, as SetParameters says it; null = it has none such.
    const ShaderRef* shader(NodeId id, const std::vector<std::string>& path) const;
    Group* group(NodeId id) { return at<Group>(id); } // to add to
    std::optional<NodeKind> kind(NodeId id) const;
    bool has_light(std::string_view name) const;
    std::string_view name(NodeId id) const; // the one that was given; of a camera "camera"
    // The nodes of a name, or "name#2", in the world or a group: one of a kind at most.
    std::vector<NodeId> find(std::string_view name, NodeId parent = NodeId::World) const;
    // "; did you mean NAME?", or nothing.
    std::string question(std::string_view name, NodeId parent = NodeId::World) const;
    // "light \"key\"", for messages.
    std::string called(NodeId id) const;

    // ---- for readers
    // Each gives what is added its id, unless it has one, and answers where it stands now: a reference holds
    // until the next is added there. Readers have checked what they add.
    Primitive& add(Primitive primitive) { return emplace(std::move(primitive)); }
    template <class... Parts>
    Primitive& emplace(Parts&&... parts) { // of a million, where it will stand
        Primitive& p = m_scene.primitives.emplace_back(std::forward<Parts>(parts)...);
        name_primitive(world(), p, m_scene.primitives.size() - 1);
        return p;
    }
    Group& add(Group group); // with all that is in it
    Group::Instances& add(Group::Instances instances);
    Light& add(Light light);
    ShaderRef& add(ShaderRef light);
    Solid& add(Solid solid);
    // The same, into a group.
    Primitive& add(Group& to, Primitive primitive);
    Group::Instances& add(Group& to, Group::Instances instances);
    Solid& add(Group& to, Solid solid);

    // What the world's nodes are named under from here on, for scenes that are read in parts; numbers of
    // those without a name begin anew.
    void set_root(NodeId root);

    // A name that a second node of its parent and kind has got as well. The first such is kept.
    struct Repeat {
        NodeKind kind;
        std::string name;
        Location where;
        std::string message() const;
    };
    const std::optional<Repeat>& repeat() const { return m_repeat; }

    static const std::string NameStays; // why a name cannot be set

    size_t index_bytes() const { return m_index.bytes(); }

  private:
    // Lists of the scene, as NodePlace has them; a group's three follow those of the groups before.
    enum List : uint32_t { Primitives, Solids, Instances, Lights, LightShaders, Groups, OfGroups };
    struct Parent {
        NodeId id;
        Unnamed& unnamed;
        uint32_t lists; // of Primitives, Solids, Instances
    };
    Parent world() { return {m_root, m_scene.unnamed, 0}; }
    Parent parent(Group& group);
    void name_primitive(const Parent& parent, Primitive& primitive, size_t index);
    void name_instances(const Parent& parent, Group::Instances& instances, size_t index);
    void name_solid(const Parent& parent, Solid& solid, size_t index);
    // Gives `node` its id, and notes where it stands.
    template <class Node>
    void name_node(const Parent& parent, NodeKind kind, std::string_view name, Node& node, NodePlace at);
    NodeId free_name(NodeId first, NodeKind kind, std::string_view name, const Location& where);
    NodeId free_number(const Parent& parent, NodeKind kind);

    NodeId id_at(NodePlace at) const;
    bool is_taken(NodeId named);
    void index_all() const;
    std::optional<NodePlace> find(NodeId id) const;
    void shine(const std::string& light);
    template <class Node>
    Node* at(NodeId id) const;

    Outcome add(Add edit);
    std::optional<Outcome> find_parent(const Add& edit, Group*& group);
    Fault fault_of_new(const Add& edit, const Group* group) const;
    bool ids_are_free(const Add& edit) const;
    Outcome remove(const Remove& edit);
    // How often what stays means each of what stands in a list.
    struct Uses {
        std::vector<size_t> groups, solids;
    };
    Uses uses_beside(const std::set<NodeId>& all) const;
    Fault fault_of_removal(NodeId id, const Uses& uses) const;
    Outcome replace(Replace edit);
    Outcome set(const Set& edit);
    Outcome set(Light& light, const Set& edit);
    Outcome set(SetParameters edit);
    template <class Change>
    void change(Primitive& primitive, const Edit& edit, const Change& how);

    Scene& m_scene;
    Options& m_options;
    Camera& m_camera;
    int m_first_group;
    NodeId m_root = NodeId::World;
    // Named: what has a name; unnamed nodes are a million spheres, and nobody asks for them while a file is
    // read.
    enum class Indexed : uint8_t { Nothing, Named, All };
    mutable Indexed m_indexed;
    mutable NodeIndex m_index;
    std::unordered_map<NodeId, uint32_t> m_repeats; // by the first's id, how many there are
    std::optional<Repeat> m_repeat;
    Delta* m_delta = nullptr;
    bool m_keeps_groups = false;
    StandInFor m_stand_in_for = nullptr;
    // That edits added, and that shine on what comes from before them.
    std::vector<std::string> m_lights;
    std::optional<bool> m_says_lights; // do attributes say which are on? Nothing: nobody has looked
    struct AttributeChange {
        std::shared_ptr<const Attributes> before, after;
        Edit edit;
    };
    // The last few, as many as edits of one primitive may take turns.
    std::array<AttributeChange, 16> m_changes;
    size_t m_next_change = 0;
};

} // namespace kanuka::scene
