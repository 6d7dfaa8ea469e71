// Procedurals that wait: what is read later is what would have stood there, and nothing else is read.

#include "scene/delayed.h"

#include <algorithm>
#include <map>

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {
namespace {

using Answers = std::map<std::string, std::string>; // RIB by the procedural's first argument

// A scene whose procedurals are answered from a table; each answer is counted.
struct Waiting {
    std::shared_ptr<scene::Delayed> delayed;
    Answers rib;
    std::vector<std::string> asked; // first arguments, in order
    std::vector<double> details;
    std::vector<std::string> folders; // of the last
    RibOptions options;

    explicit Waiting(Answers answers, bool waits = true) : rib(std::move(answers)) {
        options.procedural = [this](const ProceduralRequest& r) -> std::optional<std::string> {
            const std::string name = r.arguments.empty() ? "" : r.arguments[0];
            asked.push_back(name);
            details.push_back(r.detail);
            folders = r.folders;
            if (name == "broken")
                throw Error("it is broken");
            return rib.contains(name) ? rib[name] : "Sphere 1 -1 1 360\n";
        };
        if (waits)
            options.on_demand = &delayed;
    }
    Waiting(const Waiting&) = delete;

    size_t waiting() const { return delayed ? delayed->bounds().size() : 0; }
    const scene::Scene& read(std::vector<uint32_t> which) {
        delayed->read(which);
        return delayed->parts().back();
    }
};

std::string load(const std::string& name, const std::string& bound = "-1 1 -1 1 -1 1") {
    return "Procedural \"DynamicLoad\" [\"" + name + "\" \"\"] [" + bound + "]\n";
}

// What places and colours a primitive, as text.
std::string described(const scene::Primitive& p) {
    std::string s = std::to_string(p.geometry.index());
    for (const auto& row : p.world_from_object->m)
        for (const double x : row)
            s += " " + std::to_string(x);
    const scene::Attributes& a = *p.attributes;
    s += " | " + std::to_string(a.color.x) + " " + std::to_string(a.color.y) + " " + a.name + " " +
         (a.surface ? a.surface->name : "-") + " " + std::to_string(a.sides) + " " +
         std::to_string(a.shading_rate) + " |";
    for (const scene::Value& v : p.primvars.values)
        s += " " + v.name + " " + std::to_string(v.floats.size());
    return s;
}

} // namespace

TEST(OnDemand, NothingIsReadUntilItIsAskedFor) {
    Waiting w(Answers{});
    const Parsed r(world("Translate 0 0 5 Scale 2 2 2 " + load("a", "-1 1 -2 2 -3 3") + load("b") +
                         "Sphere 1 -1 1 360 " + load("c", "0 1 0 1 0 1")),
                   w.options);
    EXPECT_SILENT(r);
    EXPECT_TRUE(w.asked.empty());
    ASSERT_EQ(w.waiting(), 3u);
    EXPECT_EQ(r.scene.primitives.size(), 1u);
    expect_point(w.delayed->bounds()[0].lo, -2, -4, -1); // in the world
    expect_point(w.delayed->bounds()[0].hi, 2, 4, 11);

    EXPECT_EQ(w.read({2}).primitives.size(), 1u);
    EXPECT_EQ(w.asked, std::vector<std::string>{"c"});
    EXPECT_TRUE(w.delayed->is_read(2));
    EXPECT_FALSE(w.delayed->is_read(0));
    EXPECT_EQ(w.read({1, 0}).primitives.size(), 2u);
    EXPECT_EQ(w.asked, (std::vector<std::string>{"c", "b", "a"}));
    EXPECT_EQ(w.delayed->read_count(), 3u);
    EXPECT_EQ(w.delayed->parts().size(), 2u);
    EXPECT_SILENT(r);
}

TEST(OnDemand, WhatIsReadLaterIsWhatWouldHaveStoodThere) {
    const Answers answers = {
        {"red", "Color 1 0 0 Sphere 1 -1 1 360 Translate 1 0 0 Surface \"own\" Cone 1 1 360"},
        {"inherits",
         "Patch \"bicubic\" \"P\" [0 0 0 1 0 0 2 0 0 3 0 0 0 1 0 1 1 0 2 1 0 3 1 0 "
         "0 2 0 1 2 0 2 2 0 3 2 0 0 3 0 1 3 0 2 3 0 3 3 0] PatchMesh \"bicubic\" 4 \"nonperiodic\" "
         "5 \"nonperiodic\" \"P\" [0 0 0 1 0 0 2 0 0 3 0 0 0 1 0 1 1 0 2 1 0 3 1 0 0 2 0 1 2 0 2 2 0 "
         "3 2 0 0 3 0 1 3 0 2 3 0 3 3 0 0 4 0 1 4 0 2 4 0 3 4 0]"},
        {"declares", "Declare \"heat\" \"uniform float\" Sphere 1 -1 1 360 \"heat\" [2]"}};
    const std::string text =
        world("Translate 0 0 9\nAttributeBegin Rotate 30 0 1 0 Color 0 1 0 Sides 1\n" + load("red") +
              "AttributeEnd\nAttributeBegin Basis \"b-spline\" 1 \"b-spline\" 1 ShadingRate 3\n"
              "Attribute \"identifier\" \"name\" \"box\" Surface \"matte\"\n" +
              load("inherits", "0 3 0 4 0 1") + "AttributeEnd\n" + load("declares") + "Disk 0 1 360");
    Waiting later(answers), now(answers, false);
    const Parsed a(text, later.options), b(text, now.options);
    EXPECT_EQ(b.messages(Severity::Warning).size(), 0u); // two are called "box"
    ASSERT_EQ(later.waiting(), 3u);
    // In another order than they stand in: each has its own state.
    std::vector<std::string> found(6), expected;
    const scene::Scene &declares = later.read({2}), &others = later.read({1, 0});
    ASSERT_EQ(others.primitives.size(), 4u);
    found = {described(others.primitives[2]),   described(others.primitives[3]),
             described(others.primitives[0]),   described(others.primitives[1]),
             described(declares.primitives[0]), described(a.primitive(0))};
    for (const scene::Primitive& p : b.scene.primitives)
        expected.push_back(described(p));
    EXPECT_EQ(found, expected);
    EXPECT_SILENT(a);
}

TEST(OnDemand, WhatAFrameHasSetCountsAfterItsEnd) {
    const std::string text = "FrameBegin 1 Format 64 64 1 Projection \"perspective\" \"fov\" 20 "
                             "Option \"searchpath\" \"procedural\" \"own\" "
                             "WorldBegin Translate 0 0 9 " +
                             load("a") + " WorldEnd FrameEnd\n";
    Waiting later(Answers{}), now(Answers{}, false);
    const Parsed a(text, later.options), b(text, now.options);
    ASSERT_EQ(later.waiting(), 1u);
    later.read({0});
    EXPECT_EQ(later.details, now.details);
    EXPECT_GT(later.details[0], 100);
    EXPECT_EQ(later.folders, now.folders);
    EXPECT_NE(std::ranges::find(later.folders, "own"), later.folders.end());
}

// ---- frames of a shot

TEST(Expansions, AShotAsksForWhatItsNearestCameraNeeds) {
    const auto frame = [](double z) {
        return "Format 64 64 1 Projection \"perspective\" \"fov\" 40 Translate 0 0 " + std::to_string(z) +
               " WorldBegin " + load("a") + " WorldEnd\n";
    };
    std::vector<scene::Camera> shot;
    std::vector<double> alone;
    for (const double z : {9, 5, 7}) {
        Waiting w(Answers{}, false);
        shot.push_back(Parsed(frame(z), w.options).scene.camera);
        alone.push_back(w.details.at(0));
    }
    const auto all = std::make_shared<Expansions>(shot, uint64_t(1) << 20);
    for (const double z : {9, 5, 7}) {
        Waiting w(Answers{}, false);
        w.options.expansions = std::make_shared<Expansions::Frame>(all);
        const Parsed r(frame(z), w.options);
        EXPECT_EQ(w.options.expansions->counts().kept, z == 9 ? 0u : 1u);
        EXPECT_EQ(w.details, z == 9 ? std::vector{alone[1]} : std::vector<double>{});
        EXPECT_EQ(r.scene.primitives.size(), 1u);
    }
}

TEST(Expansions, WhatMadeUseOfDetailIsAskedAgainAtAnother) {
    const std::vector<std::string> uses = {"a", "b"};
    const auto all = std::make_shared<Expansions>(std::vector<scene::Camera>(), uint64_t(1) << 20);
    for (int k = 0; k < 3; k++) {
        Expansions::Frame frame(all);
        for (const std::string& name : uses) {
            const ProceduralRequest r{"DynamicLoad", {name}, k < 2 ? 5.0 : 6.0, {}};
            const auto answer = frame.answer(r, [&]() -> std::optional<std::string> {
                r.uses_detail->store(name == "a");
                return name + std::to_string(k);
            });
            EXPECT_EQ(answer, name + (k == 2 && name == "a" ? "2" : "0"));
        }
        EXPECT_EQ(frame.counts().asked, k == 0 ? 2u : k == 1 ? 0u : 1u);
        ASSERT_EQ(frame.reasons().size(), k == 2 ? 1u : 0u);
        if (k == 2) {
            EXPECT_EQ(frame.reasons()[0].why, "detail");
            EXPECT_EQ(frame.reasons()[0].name, "DynamicLoad a");
        }
    }
}

TEST(Expansions, WhatNobodyKnowsIsNoAnswer) {
    const auto all = std::make_shared<Expansions>(std::vector<scene::Camera>(), uint64_t(1) << 20);
    const ProceduralRequest r{"DelayedReadArchive", {"a.rib"}, 1, {}};
    for (int k = 0; k < 2; k++) {
        Expansions::Frame frame(all);
        EXPECT_FALSE(frame.answer(r, [] { return std::optional<std::string>(); }));
        EXPECT_THROW(frame.answer(r, []() -> std::optional<std::string> { throw Error("it is broken"); }),
                     Error);
        EXPECT_EQ(frame.answer(r, [] { return std::optional<std::string>("now"); }), "now");
        EXPECT_EQ(frame.counts().asked + frame.counts().kept, 1u);
    }
}

TEST(OnDemand, IdentitiesGoOn) {
    Waiting w(Answers{});
    const Parsed r(world("Sphere 1 -1 1 360 " + load("a") + load("b") + "Sphere 1 -1 1 360"), w.options);
    EXPECT_EQ(r.primitive(1).id, 2);
    EXPECT_EQ(w.read({1}).primitives[0].id, 3);
    EXPECT_EQ(w.read({0}).primitives[0].id, 4);
}

TEST(OnDemand, ProceduralsBringOthers) {
    Waiting w(Answers{{"outer", "Color 1 0 0 Translate 3 0 0 " + load("inner") +
                                    load("inner", "0 2 0 2 0 2") + "Sphere 1 -1 1 360"}});
    const Parsed r(world("Translate 0 0 5 " + load("outer", "-9 9 -9 9 -9 9")), w.options);
    ASSERT_EQ(w.waiting(), 1u);
    EXPECT_EQ(w.read({0}).primitives.size(), 1u);
    ASSERT_EQ(w.waiting(), 3u); // bounds grow
    EXPECT_EQ(w.asked, std::vector<std::string>{"outer"});
    expect_point(w.delayed->bounds()[2].hi, 5, 2, 7);
    const scene::Scene& inner = w.read({2});
    ASSERT_EQ(inner.primitives.size(), 1u);
    EXPECT_EQ(inner.primitives[0].attributes->color.y, 0); // of the one that brought it
    expect_point(inner.primitives[0].world_from_object->point({0, 0, 0}), 3, 0, 5);
    EXPECT_SILENT(r);
}

TEST(OnDemand, TheyNestAHundredDeep) {
    Waiting w(Answers{{"self", load("self")}});
    const Parsed r(world(load("self")), w.options);
    for (uint32_t i = 0; i < w.waiting() && i < 200; i++)
        w.read({i});
    EXPECT_EQ(w.asked.size(), 100u);
    EXPECT_TRUE(r.says("procedurals nest 100 deep at most")) << r.all_messages();
}

TEST(OnDemand, ThereAreSoManyAtMost) {
    Waiting w(Answers{{"two", load("two") + load("two")}});
    w.options.most_procedurals = 20;
    const Parsed r(world(load("two")), w.options);
    for (uint32_t i = 0; i < w.waiting() && i < 200; i++)
        w.read({i});
    EXPECT_EQ(w.asked.size(), 20u);
    EXPECT_TRUE(r.says("there are more than 20")) << r.all_messages();
}

TEST(OnDemand, WhatTheirPlaceInTheFileMattersToIsReadAtOnce) {
    const std::string bound_by_nothing = "Procedural \"DynamicLoad\" [\"a\" \"\"] [-1e38 1e38 -1 1 -1 1]\n";
    for (const std::string& body :
         {bound_by_nothing, "SolidBegin \"primitive\" " + load("a") + "SolidEnd",
          "MotionBegin [0 1] Translate 0 0 1 Translate 0 0 2 MotionEnd " + load("a"),
          "ObjectBegin 1 " + load("a") + "ObjectEnd ObjectInstance 1"}) {
        Waiting w(Answers{});
        const Parsed r("Shutter 0 1\n" + world("Translate 0 0 5 " + body), w.options);
        EXPECT_EQ(w.waiting(), 0u) << body;
        EXPECT_EQ(w.asked.size(), 1u) << body;
        EXPECT_SILENT(r) << body;
    }
    Waiting w(Answers{});
    const Parsed r("Option \"procedural\" \"integer ondemand\" 0\n" + world(load("a")), w.options);
    EXPECT_EQ(w.asked.size(), 1u);
    EXPECT_FALSE(w.delayed);
}

TEST(OnDemand, WhatIsOutOfSightMayStayUnread) {
    const std::string behind = world("Translate 0 0 -9 " + load("a") + "Translate 0 0 18 " + load("b"));
    Waiting all(Answers{}), seen(Answers{});
    const Parsed a(behind, all.options),
        b("Option \"procedural\" \"integer offscreen\" 0\n" + behind, seen.options);
    EXPECT_EQ(all.waiting(), 2u); // a ray may meet it
    ASSERT_EQ(seen.waiting(), 1u);
    seen.read({0});
    EXPECT_EQ(seen.asked, std::vector<std::string>{"b"});
}

TEST(OnDemand, ObjectsOfTheSceneAndOfTheirOwnAreInstanced) {
    Waiting w(Answers{{"forest", "ObjectBegin 2 Cone 1 1 360 ObjectEnd Translate 0 2 0 ObjectInstance 1 "
                                 "ObjectInstance 2 Translate 0 2 0 ObjectInstance 2"}});
    const Parsed r(world("ObjectBegin 1 Sphere 1 -1 1 360 ObjectEnd ObjectInstance 1 " + load("forest")),
                   w.options);
    ASSERT_EQ(r.scene.groups.size(), 1u);
    const scene::Scene& part = w.read({0});
    EXPECT_SILENT(r);
    // Groups are numbered on from the scene's: index 1 is the part's first.
    ASSERT_EQ(part.groups.size(), 1u);
    std::map<int, size_t> instances;
    for (const scene::Group::Instances& i : part.instances)
        instances[i.group] += i.count();
    EXPECT_EQ(instances, (std::map<int, size_t>{{0, 1}, {1, 2}}));
}

TEST(OnDemand, LightsComeTooLate) {
    Waiting w(Answers{{"lamp", "LightSource \"pointlight\" 7 Sphere 1 -1 1 360"}});
    const Parsed r(world("LightSource \"distantlight\" 1 " + load("lamp")), w.options);
    EXPECT_EQ(w.read({0}).primitives.size(), 1u);
    EXPECT_TRUE(r.says("was left out: say Option \"procedural\" \"int ondemand\" [0]")) << r.all_messages();
}

TEST(OnDemand, WhatIsWrongIsSaidWhereItStands) {
    Waiting w(
        Answers{{"typo", "Spere 1 -1 1 360"}, {"open", "AttributeBegin Color 0 0 1 Sphere 1 -1 1 360"}});
    const Parsed r(world(load("broken") + load("typo") + load("open") + load("fine")), w.options);
    w.read({0, 1, 2, 3});
    const std::string all = r.all_messages();
    EXPECT_NE(all.find("error 3:1"), std::string::npos) << all; // the line of Procedural
    EXPECT_NE(all.find("it is broken"), std::string::npos) << all;
    EXPECT_NE(all.find("did you mean Sphere?"), std::string::npos) << all;
    const scene::Scene& part = w.delayed->parts().back();
    ASSERT_EQ(part.primitives.size(), 2u);
    EXPECT_EQ(part.primitives[1].attributes->color.x, 1); // what was left open ended there
}

} // namespace kanuka::ingest::test
