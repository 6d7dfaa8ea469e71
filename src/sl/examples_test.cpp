// Every shadeop and statement has an example that is run.
#include <set>

#include "sl/ops/examples.h"
#include "sl/ops/shadeops.h"
#include "sl/test_support.h"

namespace kanuka::sl::test {

static void check(std::span<const ops::Example> examples) {
    for (const ops::Example& e : examples) {
        SCOPED_TRACE(std::string(e.of));
        switch (e.kind) {
        case ops::Example::Value: {
            const auto r =
                evaluate(std::string(e.before) + "\nr = color(" + std::string(e.expression) + ");");
            EXPECT_NEAR(r[4 + 9 * 2].x, e.expected, 1e-5f * std::max(1.0f, std::abs(e.expected)));
            break;
        }
        case ops::Example::Surface: {
            const auto shader = compile("surface s() {" + std::string(e.before) + "}");
            ASSERT_TRUE(shader);
            TestServices services;
            EXPECT_FALSE(shader->instantiate({}, services)->program().nodes.empty());
            break;
        }
        case ops::Example::Source: {
            const auto shader = compile(std::string(e.before));
            ASSERT_TRUE(shader);
            TestServices services;
            shader->instantiate({}, services);
            EXPECT_TRUE(services.reports.empty()) << services.reports[0];
            break;
        }
        }
    }
}

TEST(SlExamples, EveryShadeopHasOne) {
    std::set<std::string_view> have, names;
    for (const ops::Example& e : ops::shadeop_examples())
        have.insert(e.of);
    for (const ops::Shadeop& op : ops::shadeops()) {
        names.insert(op.name);
        if (!op.name.starts_with("__")) {
            EXPECT_TRUE(have.count(op.name)) << op.name << " has no example in ops/examples.cpp";
        }
    }
    for (std::string_view of : have)
        EXPECT_TRUE(names.count(of)) << of << " is no shadeop";
}

// The names of RISpec 3.2, chapters 15 and 16.
TEST(SlExamples, NoneIsMissingFromTheSpecification) {
    const char* names[] = {
        "radians",      "degrees",     "sin",        "asin",         "cos",         "acos",
        "tan",          "atan",        "pow",        "exp",          "sqrt",        "inversesqrt",
        "log",          "mod",         "abs",        "sign",         "min",         "max",
        "clamp",        "floor",       "ceil",       "round",        "step",        "smoothstep",
        "filterstep",   "spline",      "Du",         "Dv",           "Deriv",       "random",
        "noise",        "pnoise",      "cellnoise",  "xcomp",        "ycomp",       "zcomp",
        "setxcomp",     "setycomp",    "setzcomp",   "length",       "normalize",   "distance",
        "ptlined",      "rotate",      "area",       "faceforward",  "reflect",     "refract",
        "fresnel",      "transform",   "vtransform", "ntransform",   "depth",       "calculatenormal",
        "comp",         "setcomp",     "mix",        "ctransform",   "determinant", "translate",
        "scale",        "mtransform",  "printf",     "format",       "concat",      "match",
        "ambient",      "diffuse",     "specular",   "specularbrdf", "phong",       "trace",
        "texture",      "environment", "shadow",     "textureinfo",  "atmosphere",  "displacement",
        "lightsource",  "surface",     "incident",   "opposite",     "attribute",   "option",
        "rendererinfo", "shadername"};
    for (const char* name : names)
        EXPECT_TRUE(ops::find_shadeop(name)) << name;
}

TEST(SlExamples, Shadeops) {
    check(ops::shadeop_examples());
}
TEST(SlExamples, Statements) {
    check(ops::statement_examples());
}

} // namespace kanuka::sl::test
