// What published surfaces lean on beyond RISpec's letter.
#include <set>

#include "sl/test_support.h"

namespace kanuka::sl::test {

namespace {

// Pictures whose names begin with "there" exist.
class Pictures : public TestServices {
  public:
    int lookups = 0;
    bool query(const Query& q) override {
        if (q.kind != Query::Texture || std::strcmp(q.name, "exists") != 0)
            return TestServices::query(q);
        q.floats[0] = std::strncmp(q.file, "there", 5) == 0;
        return true;
    }
    void environment(const TextureRequest& q, const float* x, const float* y, const float* z) override {
        lookups++;
        TestServices::environment(q, x, y, z);
    }
};

struct Shaded {
    std::unique_ptr<Instance> instance;
    grid::VertexInputs out;
    Vec3f at(const std::string& name, int vertex) const {
        const int s = slot(instance->program(), name);
        return s < 0 ? Vec3f(-1, -1, -1) : value(out, s, vertex);
    }
};

Shaded shade(const std::string& source, TestServices& services, std::vector<Argument> args = {},
             Config c = {}, GridGlobals globals = {}) {
    Shaded r;
    r.instance = compile(source, c)->instantiate(args, services);
    grid::Grid g = plane(8, 5);
    r.instance->shade(g, globals, services, r.out);
    return r;
}

constexpr const char* Chrome = R"(
surface chrome(string map = ""; float Kr = 0.5;) {
    Oi = Os;
    Ci = Os * (Kr * environment(map, reflect(normalize(I), normalize(N))) + 0.25 * diffuse(N));
})";

} // namespace

// The picture that is named is what a mirror shows, as the dicing camera sees it; else it mirrors the scene.
TEST(SlClassic, EnvironmentPicturesAreSeenInMirrors) {
    GridGlobals globals;
    globals.E = Vec3f(1, -0.5f, 2);
    const auto named = [](const char* name) { return std::vector<Argument>{{"map", {}, {name}, false}}; };
    for (const Config c : configs()) {
        Pictures services;
        const Shaded seen = shade(Chrome, services, named("there.env"), c, globals);
        EXPECT_EQ(services.lookups, 1);
        EXPECT_TRUE(services.reports.empty());
        // The middle column, first row: P = (1, 0, 0), so I = (0, 0.5, -2), mirrored (0, 0.5, 2) / |I|.
        const Vec3f expected = 0.5f * normalize(Vec3f(0, 0.5f, 2)),
                    radiance = seen.at("emission.radiance", 4);
        for (int k = 0; k < 3; k++)
            EXPECT_NEAR(radiance[k], expected[k], 1e-5);
        EXPECT_EQ(seen.at("mirror.reflectance", 4), Vec3f(0, 0, 0));
        EXPECT_EQ(seen.at("diffuse.diffuseReflectance", 4), Vec3f(0.25f, 0.25f, 0.25f));

        for (const char* name : {"", "missing.env"}) {
            Pictures other;
            const Shaded traced = shade(Chrome, other, named(name), c, globals);
            EXPECT_EQ(other.lookups, 0);
            EXPECT_EQ(traced.at("mirror.reflectance", 4), Vec3f(0.5f, 0.5f, 0.5f));
            EXPECT_EQ(traced.at("emission.radiance", 4), Vec3f(0, 0, 0));
            ASSERT_EQ(other.reports.size(), *name ? 1u : 0u);
            if (*name) {
                EXPECT_NE(other.reports[0].find("\"missing.env\" is not found"), std::string::npos);
            }
        }
    }
    // Nor is it a matter for a warning that the picture is seen from one place; strictly it is no picture.
    Journal journal;
    ASSERT_TRUE(compile(Chrome, {}, &journal));
    EXPECT_TRUE(journal.entries().empty()) << messages(journal);
    CompileOptions strict;
    strict.use_cache = false;
    strict.strict_directions = true;
    const auto shader = compile_source("test.sl", Chrome, strict, journal);
    ASSERT_TRUE(shader) << messages(journal);
    Pictures services;
    EXPECT_EQ(slot(shader->instantiate({}, services)->program(), "emission.radiance"), -1);
}

// No picture at all is named: no choice is left to the run time.
TEST(SlClassic, EnvironmentWithoutNameIsAMirrorAlone) {
    Pictures services;
    const Shaded s = shade("surface a() { Oi = Os; Ci = environment(\"\", reflect(I, N)); }", services);
    EXPECT_EQ(slot(s.instance->program(), "emission.radiance"), -1);
    EXPECT_EQ(s.at("mirror.reflectance", 0), Vec3f(1, 1, 1));
}

TEST(SlClassic, RandomIsAnotherNumberAtEachCall) {
    for (const char* three :
         {"r = color(random(), random(), random());",
          "float a[3]; float i; for (i = 0; i < 3; i += 1) a[i] = random(); r = color(a[0], a[1], a[2]);",
          "float a = 0, b = 0; if (u > 0.3) { a = random(); b = random(); } else { b = random(); a = 0.123; }"
          "r = color(a, b, random());",
          "r = color random();"}) {
        const std::vector<Vec3f> values = evaluate(three, {}, 0); // the same at any lane count
        std::set<float> different;
        for (const Vec3f& v : values)
            for (int k = 0; k < 3; k++) {
                EXPECT_TRUE(v[k] >= 0 && v[k] < 1);
                different.insert(v[k]);
            }
        EXPECT_GT(different.size(), 130u) << three; // of 162
    }
    // Light does not make light of it, not even in a loop that stands for all directions.
    TestServices services;
    const Shaded s = shade("surface a() { color c = 0; illuminance(P, N, 1.5) c += Cl * sqrt(random());"
                           "Oi = 1; Ci = c + random(); }",
                           services);
    EXPECT_GT(s.at("emission.radiance", 3).x, 0);
    EXPECT_LT(s.at("emission.radiance", 3).x, 1);
}

TEST(SlClassic, PowersAndLogarithmsThatAreNotThereAreZero) {
    TestServices services;
    const auto at = [&](const std::string& x) {
        return evaluate("r = " + x + ";", {}, 4e-6f, &services)[2].x;
    };
    EXPECT_EQ(at("pow(u - 2, 1.6)"), 0);
    EXPECT_EQ(at("pow(-2, u + 0.1)"), 0);
    EXPECT_EQ(at("log(u - 0.25)"), 0); // of 0
    EXPECT_EQ(at("log(-u)"), 0);
    const size_t told = services.reports.size();
    EXPECT_EQ(told, 4 * configs().size());
    EXPECT_NE(services.reports[0].find("pow() of a negative number to a power that is not whole"),
              std::string::npos);
    EXPECT_NE(services.reports.back().find("log() of a number that is not positive"), std::string::npos);
    // What is there, or is not asked for, is told to nobody.
    EXPECT_NEAR(at("pow(u - 2, 2)"), 1.75f * 1.75f, 1e-5);
    EXPECT_NEAR(at("pow(u - 2, floor(u * 0 + 3))"), -1.75f * 1.75f * 1.75f, 1e-4);
    EXPECT_NEAR(at("u > 0.1 ? log(u) : 0"), std::log(0.25f), 1e-6);
    evaluate("if (u > 0.1) r = log(u) + pow(u - 0.1, 0.5);", {}, 4e-6f, &services);
    EXPECT_EQ(services.reports.size(), told) << services.reports.back();
}

TEST(SlClassic, PrintfPrintsAVertexThatRuns) {
    for (const Config c : configs()) {
        TestServices services;
        shade("surface a() { if (u > 0.6) printf(\"%f %p %s\", u, P, concat(\"c\", \"d\"));"
              "if (u > 2) printf(\"never\"); Oi = 1; Ci = 0; }",
              services, {}, c);
        ASSERT_EQ(services.reports.size(), 1u);
        EXPECT_NE(services.reports[0].find("0.625 1.25 0 0 cd"), std::string::npos) << services.reports[0];
    }
}

TEST(SlClassic, NoFaultIsToldThatIsNone) {
    TestServices services;
    // Of four elements, 3.99995 is in the last one.
    EXPECT_EQ(evaluate("float a[4] = {1, 2, 3, 4}; r = a[3.99995 - u * 0.00001];", {}, 4e-6f, &services)[3].x,
              4);
    EXPECT_TRUE(services.reports.empty()) << services.reports[0];
    EXPECT_EQ(evaluate("float a[4] = {1, 2, 3, 4}; r = a[4 + u];", {}, 4e-6f, &services)[3].x, 4);
    EXPECT_FALSE(services.reports.empty());

    // The point that finds out whether a surface is opaque is one like others, and says nothing.
    TestServices quiet;
    const std::vector<Argument> args = {{"Os", {1, 1, 1}, {}, false}};
    const Shaded s = shade("surface a() { float c = 1 / length(N) + 1 / length(I) + 1 / length(dPdu);"
                           "printf(\"once\"); Oi = Os; Ci = c * 0.1 * diffuse(N); }",
                           quiet, args, {}, {.E = Vec3f(0, 0, 3)});
    EXPECT_EQ(s.instance->program().presence, -1);
    ASSERT_EQ(quiet.reports.size(), 1u);
    EXPECT_NE(quiet.reports[0].find("once"), std::string::npos);

    Journal journal;
    ASSERT_TRUE(compile("surface a() { color h; float d, x, y; point q; normal n;"
                        "d = fulltrace(P, reflect(I, N), h, x, q, n); Oi = 1; Ci = h * (x + y * 0); }",
                        {}, &journal));
    ASSERT_EQ(journal.entries().size(), 1u) << messages(journal); // y
    EXPECT_NE(messages(journal).find("\"y\" is used before"), std::string::npos);

    TestServices none;
    evaluate(
        "string sp = \"\"; point q = P; if (sp != \"\") q = transform(sp, P); r = color(xcomp(q), 0, 0);", {},
        4e-6f, &none); // a text that is empty stays so
    EXPECT_TRUE(none.reports.empty()) << none.reports[0];
}

// The same on every grid; what ends in time is right all the same.
TEST(SlClassic, EndlessLoopsAreLeft) {
    const auto shader = compile(probe("float i = 0, k = 0, j;"
                                      "if (k > go) { while (i < 1) { k += 1; } }"
                                      "for (i = 0; i < 300; i += 1) for (j = 0; j < 50; j += 1) k += 1;"
                                      "r = color(k, 0, 0);",
                                      {}, "float go = 0;"));
    ASSERT_TRUE(shader);
    const auto run = [&](float go, TestServices& services) {
        const std::vector<Argument> args = {{"go", {go}, {}, false}};
        grid::Grid g = plane(8, 5);
        return run_probe(*shader, g, services, args)[0].x;
    };
    TestServices services;
    EXPECT_EQ(run(0, services), 15000);
    EXPECT_TRUE(services.reports.empty());
    EXPECT_EQ(run(-1, services), 100'000);
    ASSERT_FALSE(services.reports.empty());
    EXPECT_NE(services.reports[0].find("this loop does not end"), std::string::npos);
    EXPECT_EQ(run(-1, services), 100'000);
    EXPECT_EQ(run(0, services), 15000);
}

// Larry Gritz' glossy highlight: with an edge, as wide as one of another exponent is at half its height.
TEST(SlClassic, HighlightsWithAnEdgeAreLobes) {
    const char* glossy = R"(
color glossy(normal N; vector V; float roughness, sharpness;) {
    color C = 0;
    float w = 0.25 * (1 - sharpness);
    extern point P;
    illuminance (P, N, PI / 2) {
        extern vector L; extern color Cl;
        float nonspec = 0;
        lightsource("__nonspecular", nonspec);
        if (nonspec < 1) {
            vector H = normalize(normalize(L) + V);
            C += Cl * ((1 - nonspec) * smoothstep(middle - w, middle + w, pow(max(0, N . H), 1 / roughness)));
        }
    }
    return C;
}
surface s() { Oi = 1; Ci = glossy(normalize(N), -normalize(I), 0.125, 0.5); })";
    const auto with = [&](const char* middle) {
        Journal journal;
        std::string source = glossy;
        for (size_t at; (at = source.find("middle")) != std::string::npos;)
            source.replace(at, 6, middle);
        const auto shader = compile(source, {}, &journal);
        EXPECT_TRUE(journal.entries().empty()) << messages(journal);
        TestServices services;
        Shaded r;
        r.instance = shader->instantiate({}, services);
        grid::Grid g = plane(8, 5);
        r.instance->shade(g, {}, services, r.out);
        EXPECT_EQ(r.at("specular.height", 3).x, 1);
        return r.at("specular.exponent", 3).x;
    };
    EXPECT_NEAR(with("0.5"), 8, 1e-4);
    EXPECT_NEAR(with("0.25"), 4, 1e-4); // pow(c, 8) = 1/4 is pow(c, 4) = 1/2
}

// Ward's highlight, as Advanced RenderMan writes it: a microfacet lobe of both widths, along its grooves.
TEST(SlClassic, WardsAnisotropicHighlightIsALobe) {
    const char* ward = R"(
color ward(normal N; vector V; vector xdir; float xroughness, yroughness;) {
    float sqr(float x) { return x * x; }
    float cos_theta_r = clamp(N . V, 0.0001, 1);
    vector X = xdir / xroughness;
    vector Y = (N ^ xdir) / yroughness;
    color C = 0;
    extern point P;
    illuminance (P, N, PI / 2) {
        extern vector L; extern color Cl;
        float nonspec = 0;
        lightsource("__nonspecular", nonspec);
        if (nonspec < 1) {
            vector LN = normalize(L);
            float cos_theta_i = LN . N;
            if (cos_theta_i > 0.0) {
                vector H = normalize(V + LN);
                float rho = exp(-2 * (sqr(X . H) + sqr(Y . H)) / (1 + H . N)) / sqrt(cos_theta_i * cos_theta_r);
                C += Cl * ((1 - nonspec) * cos_theta_i * rho);
            }
        }
    }
    return C / (4 * xroughness * yroughness);
}
surface s(float x = 0.1, y = 0.3; color Ks = 0.5;) {
    normal Nf = faceforward(normalize(N), I);
    Oi = Os;
    Ci = Os * (Ks * ward(Nf, -normalize(I), normalize(dPdu), x, y) + 0.25 * diffuse(Nf));
})";
    for (const Config c : configs()) {
        Journal journal;
        const auto shader = compile(ward, c, &journal);
        ASSERT_TRUE(shader && journal.entries().empty()) << messages(journal);
        for (const bool along : {true, false}) {
            const std::vector<Argument> args = {{"x", {along ? 0.1f : 0.3f}, {}, false},
                                                {"y", {along ? 0.3f : 0.1f}, {}, false}};
            TestServices services;
            Shaded r;
            r.instance = shader->instantiate(args, services);
            grid::Grid g = plane(8, 5);
            r.instance->shade(g, {}, services, r.out);
            EXPECT_TRUE(services.reports.empty());
            // As much light as the formula says, and the height that it has: 1 / (4 ax ay).
            EXPECT_NEAR(r.at("specular.reflectance", 3).x, 0.5f, 1e-5);
            EXPECT_NEAR(r.at("specular.roughness", 3).x, std::sqrt(0.3f), 1e-5);
            EXPECT_NEAR(r.at("specular.anisotropy", 3).x, (1 - 1 / 3.f) / 0.95f, 1e-5);
            EXPECT_NEAR(r.at("specular.rotation", 3).x, along ? 0.5f : 0.75f, 1e-5);
            EXPECT_EQ(r.at("diffuse.diffuseReflectance", 3).x, 0.25f);
        }
    }
}

// PRMan's exponent 8 / roughness, or RISpec's 1 / roughness, wherever roughness is specular()'s: in loops
// that are lobes, and in those that are none, too.
TEST(SlClassic, TheExponentOfSpecularIsAChoice) {
    const auto source = [](const char* call) {
        return std::string("surface s(float r = 0.04;) { vector V = -normalize(I); color C = 0; Oi = 1; ") +
               call + " Ci = C; }";
    };
    for (const bool rispec : {false, true}) {
        const double exponent = (rispec ? 1 : 8) / 0.04;
        CompileOptions o;
        o.use_cache = false;
        o.rispec_specular = rispec;
        const auto shaded = [&](const char* call) {
            Journal journal;
            const auto shader = compile_source("test.sl", source(call), o, journal);
            EXPECT_TRUE(shader) << messages(journal);
            TestServices services;
            Shaded r;
            r.instance = shader->instantiate({}, services);
            grid::Grid g = plane(8, 5);
            GridGlobals globals;
            globals.E = Vec3f(1, 0.5f, 40);
            r.instance->shade(g, globals, services, r.out);
            return r;
        };
        EXPECT_NEAR(shaded("C = specular(N, V, r);").at("specular.exponent", 3).x, exponent, 1e-3);
        EXPECT_NEAR(shaded("illuminance(P, N, PI / 2) C += Cl * specularbrdf(L, N, V, r);")
                        .at("specular.exponent", 3)
                        .x,
                    exponent, 1e-3);
        EXPECT_NEAR(shaded("illuminance(P, N, PI / 2) C += Cl * pow(N . normalize(normalize(L) + V), 1 / r);")
                        .at("specular.exponent", 3)
                        .x,
                    25, 1e-3)
            << "which says itself what it is";
        // A kernel that is no lobe's keeps its albedo: 1/pi times the integral of cos(theta / 2)^n over the
        // hemisphere, seen head-on. The cube of the cosine of L makes it none, and little less at its axis.
        double albedo = 0;
        constexpr int N = 20000;
        for (int k = 0; k < N; k++) {
            const double c = (k + 0.5) / N;
            albedo += 2 * std::pow(std::sqrt((1 + c) / 2), 8 / 0.8 / (rispec ? 8 : 1)) * c * c * c / N;
        }
        EXPECT_NEAR(
            shaded("illuminance(P, N, PI / 2) C += Cl * specularbrdf(L, N, V, 0.8) * pow(normalize(L) . "
                   "N, 3);")
                .at("diffuse.diffuseReflectance", 22)
                .x,
            albedo, 0.01 * albedo);
    }
}

// Names of textures that vary: one lookup for each that is chosen.
TEST(SlClassic, NamesOfTexturesMayVary) {
    struct Files : TestServices {
        std::set<std::string> asked;
        void texture(const TextureRequest& q) override {
            asked.insert(q.file);
            for (int k = 0; k < q.channels; k++)
                for (int i = 0; i < q.count; i++)
                    q.result[k * q.result_stride + i] = (q.file[0] == 'a' ? 0.25f : 0.75f) + 0.125f * q.s[i];
        }
    };
    const char* source = R"(surface s(string first = "a.tx", second = "b.tx"; float where = 0.5;) {
        string map = first;
        if (u > where) map = second;
        Oi = 1; Ci = color texture(map, u, v) * diffuse(N);
    })";
    for (const Config c : configs()) {
        Journal journal;
        const auto shader = compile(source, c, &journal);
        ASSERT_TRUE(shader) << messages(journal);
        for (const float where : {0.5f, 2.0f}) {
            Files services;
            Shaded r;
            const std::vector<Argument> args = {{"where", {where}, {}, false}};
            r.instance = shader->instantiate(args, services);
            grid::Grid g = plane(8, 5);
            r.instance->shade(g, {}, services, r.out);
            for (int i = 0; i < 9; i++) {
                const float u = float(i) / 8, expected = (u > where ? 0.75f : 0.25f) + 0.125f * u;
                EXPECT_FLOAT_EQ(r.at("diffuse.diffuseReflectance", i).x, expected) << c.lanes << " " << i;
            }
            EXPECT_EQ(services.asked.size(), where < 1 ? 2u : 1u) << "what nobody chooses is not read";
        }
    }
}

// vertex hpoint __Pref for a parameter of type point: interpolated with its weight, then divided by it.
TEST(SlClassic, HomogeneousPointsServeAsPoints) {
    const char* source =
        "surface s(varying point Pref = 0;) { Oi = 1; Ci = color(comp(Pref, 0), comp(Pref, 1), "
        "comp(Pref, 2)); }";
    for (const Config c : configs()) {
        TestServices services;
        Shaded r;
        const std::vector<Argument> args = {{"Pref", {}, {}, true}};
        r.instance = compile(source, c)->instantiate(args, services);
        grid::Grid g = plane(8, 5);
        grid::Channel pref{"Pref", 4, g.stride, std::vector<float>(size_t(g.stride) * 4 + 32)};
        for (int i = 0; i < g.vertices(); i++) {
            const float w = 1 + float(i % 7);
            pref.component(0)[i] = w * float(i), pref.component(1)[i] = w * 2, pref.component(2)[i] = w / 4;
            pref.component(3)[i] = w;
        }
        g.primvars.push_back(std::move(pref));
        r.instance->shade(g, {}, services, r.out);
        for (int i = 0; i < g.vertices(); i++) {
            EXPECT_NEAR(r.at("emission.radiance", i).x, float(i), 1e-5f * float(i));
            EXPECT_FLOAT_EQ(r.at("emission.radiance", i).y, 2);
            EXPECT_FLOAT_EQ(r.at("emission.radiance", i).z, 0.25f);
        }
    }
}

TEST(SlClassic, OcclusionByItselfIsExplained) {
    Journal journal;
    ASSERT_TRUE(compile("surface ao() { Oi = Os; Ci = Oi * (1 - occlusion(P, N, 16) + occlusion(P, N, 4)); }",
                        {}, &journal));
    ASSERT_EQ(journal.entries().size(), 1u) << messages(journal);
    EXPECT_EQ(journal.entries()[0].severity, Severity::Info);
    EXPECT_NE(journal.entries()[0].message.find("--integrator ao"), std::string::npos);
}

} // namespace kanuka::sl::test
