// The rows that options are declared by: what they refuse, in which words, and that none of them is out of
// step with the struct it sets.
#include <cmath>
#include <gtest/gtest.h>
#include <set>

#include "base/error.h"
#include "scene/schema/attributes.h"
#include "scene/schema/camera.h"
#include "scene/schema/lights.h"
#include "scene/schema/options.h"

namespace kanuka::scene {
namespace {

Setting number(double x) {
    return {{x}, {}};
}
Setting text(const char* t) {
    return {{}, {t}};
}

TEST(Parameters, EveryNameAndFlagIsItsOwn) {
    std::set<std::string> names, flags, rib;
    for (const OptionParameter& row : option_parameters()) {
        EXPECT_TRUE(names.insert(row.name).second) << row.name;
        EXPECT_TRUE(!*row.flag || flags.insert(row.flag).second) << row.flag;
        EXPECT_TRUE(!*row.rib || rib.insert(row.rib).second) << row.rib;
        EXPECT_EQ(find_option(row.name), &row);
        EXPECT_GT(std::string_view(row.about).size(), 2u) << row.name;
    }
    EXPECT_GT(names.size(), 30u);
}

// What a default-constructed scene has can be read, is taken again, and changes nothing.
template <class Of>
void expect_defaults_in_range(std::span<const Parameter<Of>> rows) {
    Of of;
    for (const auto& row : rows) {
        const Setting before = row.get(of);
        EXPECT_EQ(row.set(of, before), std::nullopt) << row.name;
        EXPECT_EQ(row.get(of), before) << row.name;
    }
}

TEST(Parameters, DefaultsAreInTheirOwnRange) {
    expect_defaults_in_range(option_parameters());
    expect_defaults_in_range(attribute_parameters());
    expect_defaults_in_range(camera_parameters());
}

// Another value than there is.
Setting other_than(const Setting& now, const ParameterInfo& row) {
    if (row.optional && now == Setting{})
        return {{-1, 2, -3, 4}, {}};
    if (row.count == 0)
        return row.kind == Kind::Number ? Setting{{0.25, 0.75}, {}} : Setting{{}, {"one", "two"}};
    Setting other = now;
    for (double& x : other.numbers)
        x = row.kind == Kind::Flag ? 1 - x : row.range.most == 1 ? x * 0.5 + 0.125 : double(float(x + 3));
    for (std::string& t : other.texts) {
        const std::string_view choices = row.choices;
        t = choices.empty() ? "other" : std::string(choices.substr(choices.rfind(' ') + 1));
    }
    return other;
}

// A row sets what it reads, and no other row's value.
template <class Of>
void expect_rows_apart(std::span<const Parameter<Of>> rows) {
    const Of fresh;
    for (const auto& row : rows) {
        Of of;
        const Setting other = other_than(row.get(of), row);
        ASSERT_EQ(row.set(of, other), std::nullopt) << row.name;
        EXPECT_EQ(row.get(of), other) << row.name;
        for (const auto& beside : rows) {
            if (&beside != &row) {
                EXPECT_EQ(beside.get(of), beside.get(fresh)) << row.name << " sets " << beside.name;
            }
        }
    }
}

TEST(Parameters, RowsDoNotOverlap) {
    expect_rows_apart(option_parameters());
    expect_rows_apart(attribute_parameters());
    expect_rows_apart(camera_parameters());
}

TEST(Parameters, EveryKindOfLightTakesItsDefaultsAndNoNameTwice) {
    for (const LightKind& kind : light_kinds()) {
        EXPECT_EQ(find_light_kind(kind.name), &kind);
        EXPECT_EQ(find_light_shader(kind.shader), &kind);
        std::set<std::string_view> names, shaders;
        for (const LightParameter& row : light_parameters()) {
            if (!row.is_of(kind))
                continue;
            LightSettings s = kind.defaults();
            const Setting before = row.get(s);
            if (before.texts != std::vector<std::string>{""}) {
                EXPECT_EQ(row.set(s, before), std::nullopt) << kind.name << ", " << row.name;
            }
            EXPECT_EQ(row.get(s), before) << kind.name << ", " << row.name;
            EXPECT_TRUE(names.insert(row.name).second) << row.name;
            for (const std::string_view name : words_of(row.rib))
                EXPECT_TRUE(shaders.insert(name).second) << name;
        }
        EXPECT_TRUE(names.contains("name")) << kind.name;
        for (const char* name : {"amount", "group"}) // of what has light of its own
            EXPECT_EQ(names.contains(name), kind.kind != Light::Kind::Portal) << kind.name;
    }
    for (const LightParameter& row : light_parameters())
        EXPECT_TRUE(std::ranges::any_of(light_kinds(), [&](const LightKind& k) { return row.is_of(k); }))
            << row.name;
}

TEST(Parameters, ProjectionsAreThoseThatThereAre) {
    EXPECT_EQ(find_camera_parameter("projection")->choices, projection_names<std::string>(" "));
    const Setting nothing;
    Camera camera;
    const CameraParameter& window = *find_camera_parameter("screen_window");
    EXPECT_TRUE(window.set(camera, {{1, 1, 0, 1}, {}})) << "no width";
    EXPECT_EQ(window.set(camera, {{-1, 1, -2, 2}, {}}), std::nullopt);
    EXPECT_EQ(camera.screen_window, (std::array<float, 4>{-1, 1, -2, 2}));
    EXPECT_EQ(window.set(camera, nothing), std::nullopt);
    EXPECT_FALSE(camera.screen_window);
    for (const double sides : {1.0, 2.0, 65.0})
        EXPECT_TRUE(find_camera_parameter("blades")->set(camera, {{sides}, {}})) << sides;
    camera.fov = 200;
    EXPECT_TRUE(fault_of_fov(camera));
    camera.projection = Projection::Fisheye;
    EXPECT_FALSE(fault_of_fov(camera));
}

TEST(Parameters, OneNumberStandsForAColour) {
    LightSettings s;
    const LightParameter& amount = *find_light_parameter("amount");
    EXPECT_EQ(amount.set(s, {{2}, {}}), std::nullopt);
    EXPECT_EQ(amount.get(s), (Setting{{2, 2, 2}, {}}));
    EXPECT_EQ(amount.set(s, {{1, 2, 3}, {}}), std::nullopt);
    EXPECT_EQ(amount.get(s), (Setting{{1, 2, 3}, {}}));
    EXPECT_TRUE(amount.set(s, {{1, 2}, {}}));
    EXPECT_EQ(amount.get(s), (Setting{{1, 2, 3}, {}}));
}

TEST(Parameters, RefusalsSayWhatWouldDo) {
    Options options;
    const auto refusal = [&](const char* name, const Setting& value) {
        return find_option(name)->set(options, value).value_or("");
    };
    EXPECT_EQ(refusal("max_depth", number(-1)), "max_depth: expected a whole number from 0 to 1000, got -1");
    EXPECT_EQ(refusal("max_depth", number(2.5)),
              "max_depth: expected a whole number from 0 to 1000, got 2.5");
    EXPECT_EQ(refusal("max_depth", text("deep")),
              "max_depth: expected a whole number from 0 to 1000, got \"deep\"");
    EXPECT_EQ(refusal("geometry_tolerance", number(-1)),
              "geometry_tolerance: expected a number of pixels, 0 or more, got -1");
    EXPECT_EQ(refusal("pixel_aspect", number(0)), "pixel_aspect: expected a number above 0, got 0");
    EXPECT_EQ(refusal("transport", text("none")), "transport: expected full, classic or auto, got \"none\"");
    EXPECT_EQ(refusal("resolution", number(4)),
              "resolution: expected 2 whole numbers of pixels from 1 to 1073741824, got 4");
    EXPECT_EQ(refusal("resolution", {{1 << 20, 1 << 20}, {}}), "resolution: at most 2^30 pixels");
    EXPECT_EQ(refusal("shutter", {{2, 1}, {}}), "shutter: it must open before it closes");
    EXPECT_EQ(refusal("crop", {{0.5, 0.5, 0, 1}, {}}), "crop: expected xmin < xmax and ymin < ymax");
    for (const double x : {double(NAN), double(INFINITY), 1e39})
        EXPECT_NE(refusal("iso", number(x)), "") << x;
    EXPECT_EQ(options.max_depth, Options().max_depth); // nothing was changed
}

TEST(Parameters, EditsGoOverInOrder) {
    OptionEdits edits;
    edits.set("max_depth", 3);
    edits.set("transport", "classic");
    edits.set("seed", 4294967295.0);
    edits.set("max_depth", 5);
    EXPECT_TRUE(edits.has("seed"));
    EXPECT_FALSE(edits.has("integrator"));
    Options options;
    edits.apply(options);
    EXPECT_EQ(options.max_depth, 5);
    EXPECT_EQ(options.transport, Options::Transport::Classic);
    EXPECT_EQ(options.seed, 4294967295u);
    EXPECT_THROW(edits.set("max_dept", 3), Error);
    EXPECT_THROW(edits.set("max_depth", 1e7), Error);
}

TEST(Parameters, RibNames) {
    EXPECT_EQ(find_rib_option("kanuka:maxdepth"), find_option("max_depth"));
    EXPECT_EQ(find_rib_option("kanuka:samples"), find_rib_option("kanuka:progressions"));
    EXPECT_EQ(find_rib_option("color:space"), find_option("color_space"));
    EXPECT_EQ(find_rib_option("kanuka:max"), nullptr);
    EXPECT_EQ(find_rib_option(""), nullptr);
    EXPECT_EQ(rib_names_of(option_parameters(), "exposure"), "fstop, shutter, iso, stops");
}

} // namespace
} // namespace kanuka::scene
