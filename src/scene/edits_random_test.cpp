// Random runs of edits against a model that knows nothing of the editor: a list of what there should be.
#include <gtest/gtest.h>
#include <random>
#include <set>

#include "scene/edits_test_support.h"

namespace kanuka::scene::testing {
namespace {

struct Model {
    struct Entry {
        std::string parent, kind;
        Description is;
    };
    std::vector<std::pair<NodeId, Entry>> nodes; // in order of addition
    Description options, camera;

    Entry* find(NodeId id) {
        for (auto& [known, entry] : nodes)
            if (known == id)
                return &entry;
        return nullptr;
    }
};

class Walk {
  public:
    explicit Walk(uint32_t seed) : m_random(seed) { m_editor.record(&delta); }

    Scene scene;
    Model model;
    Delta delta;
    int refused = 0;

    void step() {
        switch (pick(10)) {
        case 0:
        case 1:
        case 2:
            add();
            break;
        case 3:
            remove();
            break;
        case 4:
            place();
            break;
        case 5:
            shape();
            break;
        case 6:
            parameter();
            break;
        case 7:
            nonsense();
            break;
        default:
            set();
        }
    }

  private:
    size_t pick(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(m_random); }
    double number_() { return double(pick(1000)) / 8; }
    std::string name() {
        constexpr const char* names[] = {"", "", "a", "b", "c"};
        return names[pick(5)];
    }
    NodeId any(const std::string& kind) {
        std::vector<NodeId> all;
        for (const auto& [id, entry] : model.nodes)
            if (kind.empty() || entry.kind == kind)
                all.push_back(id);
        return all.empty() ? NodeId::None : all[pick(all.size())];
    }

    void add() {
        const size_t kind = pick(6);
        const NodeId group = any("group");
        const bool in_group = group != NodeId::None && pick(2) == 0;
        const NodeId parent = in_group ? group : NodeId::World;
        Model::Entry entry;
        Outcome out;
        const std::string given = name();
        if (kind < 2) {
            const auto radius = float(number_() + 1);
            out = m_editor.apply(Add{parent, ball(given, radius)});
            entry = {in_group ? to_text(group) : "", "primitive", described(ball(given, radius))};
        } else if (kind == 2) {
            out = m_editor.apply(Add{NodeId::World, lamp(given)});
            entry = {"", "light", described(lamp(given))};
        } else if (kind == 3) {
            out = m_editor.apply(Add{NodeId::World, light_shader(given)});
            entry = {"", "light shader", described(light_shader(given))};
        } else if (kind == 4) {
            Group g;
            g.name = given;
            out = m_editor.apply(Add{NodeId::World, g});
            entry = {"", "group", {{"name", given}}};
        } else if (group == NodeId::None) {
            return;
        } else {
            Group::Instances i;
            i.group = number_of(any("group"));
            i.transforms = std::vector<float>(12 * (1 + pick(3)), float(number_()));
            const NodeId of = scene.groups[size_t(i.group)].node;
            const bool backwards = in_group && number_of(group) <= i.group;
            entry = {in_group ? to_text(group) : "",
                     "instances",
                     {{"group", to_text(of)}, {"places", text_of(i.transforms)}}};
            out = m_editor.apply(Add{parent, i});
            ASSERT_EQ(out.refusal.empty(), !backwards) << out.refusal;
        }
        if (!out.refusal.empty())
            return;
        ASSERT_FALSE(model.find(out.id)) << "an id that was there";
        entry.is["parent"] = entry.parent;
        model.nodes.emplace_back(out.id, entry);
    }
    int number_of(NodeId group) {
        for (size_t i = 0; i < scene.groups.size(); i++)
            if (scene.groups[i].node == group)
                return int(i);
        return -1;
    }

    void remove() {
        std::vector<NodeId> ids;
        for (size_t n = 1 + pick(3); n > 0 && !model.nodes.empty(); n--)
            ids.push_back(any(""));
        std::set<std::string> going;
        std::set<NodeId> all(ids.begin(), ids.end());
        for (const NodeId id : ids)
            going.insert(to_text(id));
        bool placed = false; // a group whose instances stay
        for (const auto& [id, e] : model.nodes)
            placed = placed || (e.kind == "instances" && going.contains(e.is.at("group")) &&
                                !all.contains(id) && !going.contains(e.parent));
        const Outcome out = m_editor.apply(Remove{ids});
        ASSERT_EQ(out.refusal.empty(), !placed) << out.refusal;
        if (placed)
            return;
        std::erase_if(model.nodes, [&](const auto& n) {
            return all.contains(n.first) || going.contains(n.second.parent);
        });
    }

    void place() {
        const Transform t = Transform::translate(number_(), number_(), 0) * Transform::scale(2, 2, 2);
        const std::string kind = std::array{"primitive", "light", "light shader"}[pick(3)];
        const NodeId id = any(kind);
        if (id == NodeId::None)
            return;
        ASSERT_EQ(m_editor.apply(Replace{id, Placement{t}}).refusal, "");
        model.find(id)->is["place"] = text(t);
    }

    void shape() {
        const NodeId id = any("primitive"), placed = any("instances");
        if (id != NodeId::None) {
            const float r = float(number_() + 1);
            ValueList primvars;
            primvars.set(floats("wear", Type::Float, {float(pick(9))}));
            ASSERT_EQ(
                m_editor.apply(Replace{id, Shape{Quadric{Quadric::Kind::Sphere, {r, -r, r, 360}}, primvars}})
                    .refusal,
                "");
            model.find(id)->is["radius"] = text(double(r));
            model.find(id)->is["primvars"] = "wear " + text_of(primvars.values[0].floats);
        }
        if (placed != NodeId::None) {
            const std::vector<float> places(24, float(number_()));
            ASSERT_EQ(m_editor.apply(Replace{placed, Places{places}}).refusal, "");
            model.find(placed)->is["places"] = text_of(places);
        }
    }

    void set() {
        const double x = number_();
        if (const NodeId id = any("primitive"); id != NodeId::None) {
            ASSERT_EQ(m_editor
                          .apply(Set{id,
                                     {{"displacement_bound", number(x)},
                                      {"visible_camera", number(0)},
                                      {"lights_off", {{}, {"key"}}}}})
                          .refusal,
                      "");
            Description& is = model.find(id)->is;
            is["displacement_bound"] = text(double(float(x)));
            is["visible_camera"] = text(0);
            is["lights_off"] = "key ";
        }
        if (const NodeId id = any("light"); id != NodeId::None) {
            ASSERT_EQ(m_editor.apply(Set{id, {{"amount", number(x)}, {"radius", number(x)}}}).refusal, "");
            Description& is = model.find(id)->is;
            is["amount"] = text_of(std::array{x, x, x});
            is["radius"] = text(x);
        }
        ASSERT_EQ(m_editor.apply(Set{NodeId::World, {{"seed", number(double(pick(99)))}}}).refusal, "");
        ASSERT_EQ(m_editor.apply(Set{camera_node(), {{"fov", number(x + 1)}}}).refusal, "");
    }

    void parameter() {
        const float x = float(number_());
        if (const NodeId id = any("primitive"); id != NodeId::None) {
            ASSERT_EQ(
                m_editor.apply(SetParameters{id, {"surface"}, {floats("Kd", Type::Float, {x})}}).refusal, "");
            ASSERT_EQ(
                m_editor.apply(SetParameters{id, {"surface", "base"}, {floats("c", Type::Color, {x, x, x})}})
                    .refusal,
                "");
            ShaderRef expected = shader("matte");
            expected.parameters.set(floats("Kd", Type::Float, {x}));
            expected.coshaders[0].parameters.set(floats("c", Type::Color, {x, x, x}));
            model.find(id)->is["surface"] = parameters(expected);
        }
        if (const NodeId id = any("light shader"); id != NodeId::None) {
            ASSERT_EQ(m_editor.apply(SetParameters{id, {}, {floats("intensity", Type::Float, {x})}}).refusal,
                      "");
            ShaderRef expected = light_shader("");
            expected.parameters.set(floats("intensity", Type::Float, {x}));
            model.find(id)->is["shader"] = parameters(expected);
        }
    }

    // What cannot be: the scene stays as it was, which is seen at the end.
    void nonsense() {
        const NodeId id = any("");
        Primitive flat = ball("flat");
        flat.world_from_object = Transform::scale(1, 0, 1);
        Primitive mesh = ball("mesh");
        mesh.geometry = PolygonMesh{{}, {}, std::vector<int32_t>{0, 1, 2}};
        const Edit edits[] = {
            Add{NodeId(77), ball("")},
            Add{NodeId::World, flat},
            Add{NodeId::World, mesh},
            Remove{{id, NodeId(77)}},
            Set{NodeId(77), {{"seed", number(1)}}},
            Set{NodeId::World, {{"seed", number(5)}, {"sed", number(1)}}},
            Set{id, {{"visible_camera", number(1)}, {"name", {{}, {"b"}}}}},
            Set{any("light"), {{"radius", number(1)}, {"radius", number(-1)}}},
            SetParameters{id, {"surface", "bse"}, {floats("c", Type::Color, {0, 0, 0})}},
            SetParameters{any("primitive"), {"surface"}, {floats("Kd", Type::Color, {0, 0, 0})}},
            Replace{id, Placement{Transform::scale(0, 1, 1)}},
            Replace{id, Places{std::vector<float>(13)}},
            Replace{NodeId::World, ValueList()}};
        const Edit& edit = edits[pick(std::size(edits))];
        EXPECT_NE(m_editor.apply(edit).refusal, "") << "edit of kind " << edit.index();
        refused++;
    }

    std::mt19937 m_random;
    Editor m_editor{scene};
};

std::map<NodeId, Description> by_id(const std::vector<std::pair<NodeId, Description>>& list) {
    return {list.begin(), list.end()};
}

TEST(Edits, AnyRunComesToWhatItsListSays) {
    int refused = 0;
    for (uint32_t seed = 0; seed < 60; seed++) {
        Walk run(seed);
        for (int i = 0; i < 120 && !::testing::Test::HasFailure(); i++)
            run.step();
        std::map<NodeId, Description> expected;
        for (const auto& [id, entry] : run.model.nodes)
            expected[id] = entry.is;
        const auto found = described(run.scene);
        ASSERT_EQ(by_id(found), expected) << "seed " << seed;
        ASSERT_EQ(found.size(), expected.size());
        refused += run.refused;
    }
    EXPECT_GT(refused, 300);
}

// What is there at the end, added to an empty scene: the same nodes in the same order, with the same ids.
TEST(Edits, TheSameAsWhatIsBuiltAtOnce) {
    for (uint32_t seed = 100; seed < 130; seed++) {
        Walk run(seed);
        for (int i = 0; i < 120 && !::testing::Test::HasFailure(); i++)
            run.step();
        Scene fresh;
        Editor editor(fresh);
        for (const Group& g : run.scene.groups)
            ASSERT_EQ(editor.apply(Add{NodeId::World, g}).refusal, "");
        for (const Primitive& p : run.scene.primitives)
            ASSERT_EQ(editor.apply(Add{NodeId::World, p}).refusal, "");
        for (const Group::Instances& i : run.scene.instances)
            ASSERT_EQ(editor.apply(Add{NodeId::World, i}).refusal, "");
        for (const Light& l : run.scene.lights)
            ASSERT_EQ(editor.apply(Add{NodeId::World, l}).refusal, "");
        for (const ShaderRef& l : run.scene.light_shaders)
            ASSERT_EQ(editor.apply(Add{NodeId::World, l}).refusal, "");
        ASSERT_EQ(described(fresh), described(run.scene)) << "seed " << seed;
        // None is given an id that another has: neither by these editors nor by others that come after, nor
        // after something went.
        std::vector<Scene*> scenes{&fresh, &run.scene};
        for (Scene* s : scenes)
            for (const bool by_first : {true, false}) {
                std::optional<Editor> other;
                Editor& e = by_first && s == &fresh ? editor : other.emplace(*s);
                for (int i = 0; i < 20; i++) {
                    const Primitive p = ball(i % 2 ? "a" : "");
                    const bool in_group = i % 3 == 2 && !s->groups.empty();
                    if (in_group)
                        e.add(s->groups[0], p);
                    else
                        e.add(p);
                    if (i % 5 == 4) {
                        ASSERT_EQ(e.apply(Remove{{s->primitives[s->primitives.size() / 2].node}}).refusal,
                                  "");
                    }
                    ASSERT_EQ(by_id(described(*s)).size(), described(*s).size()) << "seed " << seed;
                }
            }
    }
}

TEST(Edits, DeltasAreWhatChanged) {
    for (uint32_t seed = 200; seed < 230; seed++) {
        Walk run(seed);
        for (int i = 0; i < 60; i++)
            run.step();
        const auto before = by_id(described(run.scene));
        run.delta = {};
        for (int i = 0; i < 60 && !::testing::Test::HasFailure(); i++)
            run.step();
        const auto after = by_id(described(run.scene));
        std::set<NodeId> added, removed;
        for (const auto& [id, is] : after)
            if (!before.contains(id))
                added.insert(id);
        for (const auto& [id, is] : before)
            if (!after.contains(id))
                removed.insert(id);
        ASSERT_EQ(run.delta.added, added) << "seed " << seed;
        ASSERT_EQ(run.delta.removed, removed);
        const std::map<std::string, Aspect> aspects = {
            {"radius", Aspect::Geometry},           {"primvars", Aspect::Primvars},
            {"place", Aspect::Placement},           {"places", Aspect::Placement},
            {"visible_camera", Aspect::Attributes}, {"displacement_bound", Aspect::Attributes},
            {"lights_off", Aspect::Links},          {"surface", Aspect::Parameters},
            {"shader", Aspect::Parameters},         {"amount", Aspect::Parameters}};
        for (const auto& [id, is] : after)
            if (before.contains(id))
                for (const auto& [what, value] : is)
                    if (const auto& was = before.at(id); !was.contains(what) || was.at(what) != value) {
                        // A light's radius is a parameter.
                        const Aspect aspect =
                            what == "radius" && is.contains("amount") ? Aspect::Parameters : aspects.at(what);
                        ASSERT_TRUE(run.delta.changed.contains(id)) << what;
                        ASSERT_TRUE(run.delta.changed.at(id).has(aspect)) << what;
                    }
        for (const auto& [id, what] : run.delta.changed)
            ASSERT_TRUE(after.contains(id) || id == camera_node() || id == NodeId::World);
    }
}

} // namespace
} // namespace kanuka::scene::testing
