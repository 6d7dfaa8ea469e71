// Classic surfaces that do more to light and to the view than a material can: what is kept of them, and what
// is said about it.
#include "sl/test_support.h"

namespace kanuka::sl::test {

using grid::LayerOp;
using grid::LobeId;

struct Shaded {
    std::shared_ptr<const Shader> shader;
    std::unique_ptr<Instance> instance;
    grid::VertexInputs out;
    std::string said;

    std::vector<LobeId> lobes() const {
        std::vector<LobeId> l;
        for (const auto& n : instance->program().nodes)
            if (n.op == LayerOp::Lobe)
                l.push_back(n.lobe);
        return l;
    }
    // A slot that is not there reads as -1.
    Vec3f operator()(const char* name, int vertex = 0) const {
        const int s = slot(instance->program(), name);
        return s < 0 ? Vec3f(-1, -1, -1) : value(out, s, vertex);
    }
    int warnings(const char* text) const {
        int n = 0;
        for (size_t at = said.find(text); at != std::string::npos; at = said.find(text, at + 1))
            n++;
        return n;
    }
};

// Shades a plane that is seen from above its middle.
static Shaded shade(const std::string& source, std::span<const Argument> args = {},
                    GridGlobals globals = {}) {
    Shaded s;
    Journal journal;
    s.shader = compile(source, {}, &journal);
    for (const auto& e : journal.entries())
        if (e.message.find("never used") == std::string::npos)
            s.said += e.where.str() + ": " + e.message + "\n";
    if (!s.shader) {
        ADD_FAILURE() << source << "\n" << s.said;
        s.shader = compile("surface failed() {}");
    }
    TestServices services;
    globals.E = Vec3f(1, 0.5f, 2);
    s.instance = s.shader->instantiate(args, services);
    grid::Grid g = plane(8, 5);
    s.instance->shade(g, globals, services, s.out);
    return s;
}

static Shaded surface(const std::string& body) {
    return shade("surface s(float Kd = 0.5;) {\n" + body + "\n}");
}

static std::string strict_errors(const std::string& body) {
    CompileOptions o;
    o.use_cache = false;
    o.strict_directions = true;
    Journal journal;
    EXPECT_FALSE(compile_source("test.sl", "surface s() {\n" + body + "\n}", o, journal)) << body;
    return messages(journal);
}

// ---- the frozen view

TEST(SlFrozenView, RimWeightsAreThoseOfTheDicingCamera) {
    const char* rim = "Oi = 1; float rim = 1 - abs(normalize(I) . normalize(N));\n"
                      "Ci = Cs * pow(rim, 2) + 0.5 * diffuse(N);";
    const Shaded s = surface(rim);
    EXPECT_EQ(s.warnings("frozen to that of the dicing camera"), 1) << s.said;
    EXPECT_NE(s.said.find("test.sl:2:"), std::string::npos) << s.said;
    EXPECT_NE(s.said.find("(emission)"), std::string::npos) << s.said;
    for (int v : {0, 22, 44}) {
        const float x = 2 * float(v % 9) / 8 - 1, y = float(v / 9) / 5 - 0.5f;
        const float rim_here = 1 - 2 / std::sqrt(x * x + y * y + 4);
        EXPECT_NEAR(s("emission.radiance", v).x, rim_here * rim_here, 1e-5);
    }
    EXPECT_EQ(s("diffuse.diffuseReflectance"), Vec3f(0.5f, 0.5f, 0.5f));
    EXPECT_NE(strict_errors(rim).find("viewing direction I"), std::string::npos);
}

TEST(SlFrozenView, FaceforwardTurnsWhatMeetsTheViewAndNothingElse) {
    const char* source = "surface s() { normal Nf = faceforward(normalize(N), I); vector V = -normalize(I);\n"
                         "Oi = 1; Ci = color(V . Nf, -(normalize(I) . Nf), V . N) + diffuse(Nf); }";
    Shaded s = shade(source);
    const float c = s("emission.radiance", 20).x;
    EXPECT_GT(c, 0.8f);
    EXPECT_FLOAT_EQ(s("emission.radiance", 20).y, c);
    grid::Grid g = plane(8, 5);
    for (int i = 0; i < g.vertices(); i++)
        g.N[size_t(2 * g.stride + i)] = -1;
    TestServices services;
    GridGlobals globals;
    globals.E = Vec3f(1, 0.5f, 2);
    s.instance->shade(g, globals, services, s.out);
    EXPECT_FLOAT_EQ(s("emission.radiance", 20).x, c); // the other side is the same
    EXPECT_EQ(g.normal(20).z, -1);
}

TEST(SlFrozenView, MaterialsThatClassesDeclareStayErrors) {
    Journal journal;
    EXPECT_FALSE(compile(R"(class c() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) { AddLobe(CreateBoundary(m), "a", LambertBrdf()); }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        SetLobe(b, "a", 1, LambertBrdf("diffuseReflectance", color(abs(normalize(I) . N)))); } })",
                         {}, &journal));
    EXPECT_NE(messages(journal).find("viewing direction I"), std::string::npos) << messages(journal);
}

TEST(SlFrozenView, ConditionsOnTheFrontOfASurfaceAreTrue) {
    const Shaded s =
        surface("vector V = -normalize(I); float a = 0, b = 0; Oi = 1;\n"
                "if (V . N > 0) a = 0.5; if (I . N < 0) b = 0.25; if (0 < normalize(I) . N) a = 1;\n"
                "Ci = (a + b) * diffuse(N);");
    EXPECT_EQ(s("diffuse.diffuseReflectance").x, 0.75f);
    EXPECT_EQ(s.said.find("viewing"), std::string::npos) << s.said;
}

// ---- fresnel()

TEST(SlFresnel, WhatIsNoDielectricIsAsTheCameraSeesIt) {
    const Shaded s = shade(R"(surface ceramic(float Kd = 0.5, eta = 0.6667;) {
    normal Nf = faceforward(normalize(N), I); float Kr, Kt;
    fresnel(normalize(I), Nf, eta, Kr, Kt);
    Oi = 1; Ci = Kd * Kt * diffuse(Nf) + Kr * specular(Nf, -normalize(I), 0.05) + 0.5 * Kr * Cs; })");
    EXPECT_EQ(s.lobes(),
              (std::vector{LobeId::LambertBrdf, LobeId::MicrofacetDielectricBrdf, LobeId::DiffuseEmission}));
    EXPECT_EQ(s.warnings("frozen"), 1) << s.said;
    const float kr = 0.04f; // near normal incidence at vertex 22, (1.5 - 1)^2 / (1.5 + 1)^2
    EXPECT_NEAR(s("diffuse.diffuseReflectance", 22).x, 0.5f * (1 - kr), 1e-3);
    EXPECT_NEAR(s("emission.radiance", 22).x, 0.5f * kr, 1e-3);
    EXPECT_NEAR(s("specular.reflectance", 22).x, 4 * 2 / (8 / 0.05 + 2),
                1e-6); // its own Fresnel term does the rest
    EXPECT_NEAR(s("specular.ior", 22).x, 1.5f, 1e-3);
    // Grazing view, stronger reflection.
    EXPECT_LT(s("diffuse.diffuseReflectance", 0).x, s("diffuse.diffuseReflectance", 22).x);
}

TEST(SlFresnel, SkippingRaysDoesNotMatter) {
    const Shaded s =
        surface("float Kr, Kt; vector R, T; fresnel(normalize(I), N, 0.6667, Kr, Kt, R, T); Oi = 1; Ci = 0;\n"
                "Kr *= 0.5; if (Kr > 0.001) Ci += Kr * trace(P, R); if (0.01 <= Kt) Ci += Kt * trace(P, T);");
    EXPECT_EQ(s("glass.reflectance").x, 0.5f);
    EXPECT_EQ(s("glass.transmittance").x, 1);
    EXPECT_EQ(s.said, "");
}

TEST(SlFresnel, FunctionsOfItAreValues) {
    const Shaded s = surface("float Kr, Kt; fresnel(normalize(I), N, 0.6667, Kr, Kt); Oi = 1;\n"
                             "Kr = smoothstep(0, 0.08, Kr); Ci = mix(Cs, color(0), Kr) * diffuse(N);");
    EXPECT_NEAR(s("diffuse.diffuseReflectance", 22).x, 0.5f, 0.02);
    EXPECT_EQ(s.lobes(), std::vector{LobeId::LambertBrdf});
}

// ---- illuminance loops that are no lobes

// N . L in a way that nobody recognises.
static const char* const Cosine = "vector Ln = normalize(L); float nl = xcomp(Ln) * xcomp(N) + ycomp(Ln) * "
                                  "ycomp(N) + zcomp(Ln) * zcomp(N);\n";

TEST(SlProjection, KeepsTheAlbedoOfAKernel) {
    const auto loop = [](const std::string& head, const std::string& body) {
        return surface("Oi = 1; color C = 0;\nilluminance(" + head + ") {" + Cosine + body + "}\nCi = C;");
    };
    const struct {
        const char *head, *body;
        float albedo, tolerance;
    } cases[] = {
        {"P, N, PI / 2", "C += Kd * Cl * nl;", 0.5f, 1e-5f},  // diffuse() itself
        {"P", "C += Kd * Cl * max(0, nl);", 0.5f, 1e-5f},     // over the whole sphere
        {"P, N, PI / 4", "C += Cl * nl;", 0.5f, 1e-5f},       // sin^2 45°
        {"P, N, Kd * PI", "C += Kd * Cl * nl;", 0.5f, 1e-5f}, // angle is a parameter
        {"\"key\", P, N, PI / 2, \"lightcache\", \"reuse\"", "C += Cl * nl * nl * nl;", 0.5f, 0.01f},
        {"P, N, PI / 2", "float k = 0.3 * nl; C = C + k * Cl;", 0.3f, 1e-5f},
        {"P, N, PI / 2", "if (nl > 0.5) C += 0.5 * Cl * nl;", 0.375f, 0.02f}, // 0.5 (1 - 0.25)
        {"P, N, PI / 2", "if (nl < 0.5) continue; C += 0.5 * Cl * nl;", 0.375f, 0.02f},
        {"P, N, PI / 2", "float unused = -1; if (lightsource(\"x\", unused) == 0) C += 0.5 * Cl * nl;", 0.5f,
         1e-5f},
    };
    for (const auto& c : cases) {
        const Shaded s = loop(c.head, c.body);
        EXPECT_EQ(s.lobes(), std::vector{LobeId::LambertBrdf}) << c.body;
        EXPECT_NEAR(s("diffuse.diffuseReflectance", 20).x, c.albedo, c.tolerance) << c.head << " " << c.body;
        EXPECT_EQ(s.warnings("is not that of a lobe"), 1) << s.said;
    }
    EXPECT_NE(
        strict_errors("Oi = 1; Ci = 0; illuminance(P, N, PI / 2) { Ci += Cl * pow(normalize(L) . N, 3); }")
            .find("is not that of a lobe"),
        std::string::npos);
}

TEST(SlProjection, OtherLoopsStayExact) {
    const Shaded s =
        surface("Oi = 1; color D = 0, S = 0; vector V = -normalize(I);\n"
                "illuminance(P, N, PI / 2) D += Kd * Cl * (normalize(L) . N);\n"
                "illuminance(P, N, PI / 2) S += 0.5 * Cl * pow(normalize(L) . N, 3);\n"
                "illuminance(P, N, PI / 2) S += Cl * pow(max(0, N . normalize(normalize(L) + V)), 10);\n"
                "Ci = D + S;");
    EXPECT_EQ(s.lobes(), (std::vector{LobeId::LambertBrdf, LobeId::HighlightBrdf}));
    EXPECT_NEAR(s("diffuse.diffuseReflectance").x, 0.75f, 0.01f); // 0.5 + 0.5 * 2 / 4
    EXPECT_EQ(s("specular.height").x, 1);
    EXPECT_EQ(s.warnings("is not that of a lobe"), 1) << s.said;
    EXPECT_NE(s.said.find("test.sl:4:"), std::string::npos) << s.said;
}

TEST(SlProjection, CelShadingIsLight) {
    // Sums without Cl become light, for they were made for each light.
    const Shaded toon = surface("Oi = 1; float d = 0; illuminance(P, N, PI / 2) { d += normalize(L) . N; }\n"
                                "Ci = Cs * color(0.8, 0.6, 0.4) * smoothstep(0.3, 0.35, d);");
    EXPECT_EQ(toon("diffuse.diffuseReflectance"), Vec3f(0.8f, 0.6f, 0.4f));
    EXPECT_EQ(toon("emission.radiance"), Vec3f(0, 0, 0));
    EXPECT_EQ(toon.warnings("is not that of a lobe"), 0) << toon.said;
    const Shaded spot =
        surface("Oi = 1; float d = 0; vector V = -normalize(I);\n"
                "illuminance(P, N, PI / 2) { d += pow(max(0, N . normalize(normalize(L) + V)), 10); }\n"
                "Ci = smoothstep(0.5, 0.6, d);");
    EXPECT_EQ(spot("specular.height").x, 1);
    EXPECT_EQ(spot("specular.exponent").x, 10);
    const Shaded sum = surface(std::string("Oi = 1; float d = 0; illuminance(P, N, PI / 2) {") + Cosine +
                               "float c = nl; c *= 2; d += c; }\nCi = Cs * smoothstep(0.3, 0.35, d);");
    EXPECT_EQ(sum("diffuse.diffuseReflectance").x, 1);
    // Functions of Cl, and conditions on it.
    const Shaded cl =
        surface(std::string("Oi = 1; color C = 0; illuminance(P, N, PI / 2) {") + Cosine +
                "if (comp(Cl, 0) > 0.5) C += color(0.25, 0.5, 0) * nl * smoothstep(0, 1, luminance(Cl)); }\n"
                "Ci = C;");
    EXPECT_NEAR(cl("diffuse.diffuseReflectance").x, 0.25f, 1e-4);
    EXPECT_NEAR(cl("diffuse.diffuseReflectance").y, 0.5f, 1e-4);
    // So is what such a loop chooses by a cosine; by anything else it glows.
    const auto choose = [](const std::string& what) {
        return surface("Oi = 1; color C = 0; illuminance(P, N, PI / 2) { if (" + what +
                       " > 0.5) C = color(0.5); }\nCi = C;");
    };
    EXPECT_EQ(choose("normalize(L) . N")("diffuse.diffuseReflectance").x, 0.5f);
    EXPECT_EQ(choose("zcomp(normalize(L)) + 1")("emission.radiance").x, 0.5f);
}

TEST(SlProjection, VariablesOfTheLoopAreNoSums) {
    const Shaded s = surface(
        "Oi = 1; color C = 0; float a, i; vector Ln;\n"
        "illuminance(P, N, PI / 2) {\n L = normalize(L); Ln = L; a = xcomp(Ln) * xcomp(N); a += ycomp(Ln) * "
        "ycomp(N);\n"
        "for (i = 0; i < 2; i += 1) a += 0.5 * zcomp(Ln) * zcomp(N);\nC += 0.5 * a * Cl;\n}\nCi = C;");
    EXPECT_NEAR(s("diffuse.diffuseReflectance").x, 0.5f, 1e-5);
    EXPECT_EQ(s.warnings("known: shading"), 0) << s.said;
}

TEST(SlProjection, OrenNayarIsAboutItsAlbedo) {
    const Shaded s = surface(R"(
    vector V = -normalize(I); normal Nn = normalize(N); float sigma = 0.5;
    float sigma2 = sigma * sigma, A = 1 - 0.5 * sigma2 / (sigma2 + 0.33), B = 0.45 * sigma2 / (sigma2 + 0.09);
    float theta_r = acos(V . Nn); vector V_perp = normalize(V - Nn * (V . Nn)); color C = 0;
    illuminance(P, Nn, PI / 2) {
        vector LN = normalize(L); float cos_i = LN . Nn; float theta_i = acos(cos_i);
        float alpha = max(theta_i, theta_r), beta = min(theta_i, theta_r);
        C += Cl * cos_i * (A + B * max(0, V_perp . normalize(LN - Nn * cos_i)) * sin(alpha) * tan(beta));
    }
    Oi = 1; Ci = C;)");
    const float albedo = s("diffuse.diffuseReflectance", 22).x;
    EXPECT_GT(albedo, 0.75f);
    EXPECT_LT(albedo, 0.95f);
}

// ---- functions of light

TEST(SlFunctionsOfLight, AreStraightLinesFromNoLightToFullLight) {
    const Shaded power = surface("color c = Kd * diffuse(N); Oi = 1;\n"
                                 "Ci = color(pow(comp(c, 0), 2), comp(c, 1), sqrt(comp(c, 2)));");
    EXPECT_NEAR(power("diffuse.diffuseReflectance").x, 0.25f, 1e-5);
    EXPECT_NEAR(power("diffuse.diffuseReflectance").y, 0.5f, 1e-6);
    EXPECT_NEAR(power("diffuse.diffuseReflectance").z, std::sqrt(0.5f), 1e-5);
    EXPECT_EQ(power("emission.radiance"), Vec3f(0, 0, 0));
    EXPECT_EQ(power.warnings("straight line"), 1) << power.said;

    EXPECT_EQ(
        surface("Oi = 1; Ci = clamp(2 * diffuse(N), color(0), color(0.75));")("diffuse.diffuseReflectance").x,
        0.75f);
    const Shaded floor = surface("Oi = 1; Ci = max(0.5 * diffuse(N), color(0.125));");
    EXPECT_NEAR(floor("emission.radiance").x, 0.125f, 1e-6);
    EXPECT_NEAR(floor("diffuse.diffuseReflectance").x, 0.375f, 1e-6);
    // max(0, x), components and mix() are what they were.
    const Shaded same =
        surface("color c = 0.5 * diffuse(N); Oi = 1;\n"
                "Ci = mix(max(c, color(0)), color(comp(c, 0), comp(c, 1), comp(c, 2)), 0.5);");
    EXPECT_NEAR(same("diffuse.diffuseReflectance").x, 0.5f, 1e-6);
    EXPECT_EQ(same.said.find("known"), std::string::npos) << same.said;
    // Several terms keep their lobes.
    const Shaded two = surface("float d = comp(0.5 * diffuse(N) + 0.25 * specular(N, -I, 0.1), 0); Oi = 1;\n"
                               "Ci = pow(d, 2);");
    EXPECT_NEAR(two("diffuse.diffuseReflectance").x, 0.5625f * 2 / 3, 1e-5);
    EXPECT_NEAR(two("specular.height").x, 0.5625f / 3, 1e-5);
    EXPECT_NEAR(surface("Oi = 1; Ci = diffuse(N) * diffuse(N);")("diffuse.diffuseReflectance").x, 1, 1e-6);
    // No infinities where there is no light.
    const Shaded divided = surface("color c = 0.5 * diffuse(N); Oi = 1; Ci = c / luminance(c) * 0.25;");
    EXPECT_NEAR(divided("diffuse.diffuseReflectance").x, 0.25f, 1e-5);
}

TEST(SlFunctionsOfLight, AssignmentsHaveAnOrder) {
    const Shaded s = surface("Oi = 1; Ci = color(0.5, 0.25, 1); color before = Ci;\n"
                             "Ci *= 0.5 * diffuse(N) + color(0, 1, 0) * specular(N, -I, 0.1); Ci *= before;");
    EXPECT_EQ(s.said, "");
    EXPECT_EQ(s("diffuse.diffuseReflectance"), Vec3f(0.125f, 0.03125f, 0.5f));
    EXPECT_NEAR(s("specular.height").y, 0.0625f, 1e-6);
    EXPECT_EQ(s("specular.height").x, 0);
    EXPECT_EQ(s.lobes().size(), 2u);
}

TEST(SlFunctionsOfLight, ConditionsAreDecidedInFullLight) {
    const Shaded toon = surface("color c = 0.8 * diffuse(N); Oi = 1;\n"
                                "if (comp(c, 0) > 0.5) Ci = color(1, 0, 0); else Ci = color(0, 0, 1);");
    EXPECT_EQ(toon("diffuse.diffuseReflectance"), Vec3f(1, 0, 0));
    EXPECT_EQ(toon("emission.radiance"), Vec3f(0, 0, 0));
    EXPECT_EQ(toon.warnings("decided as on a white surface"), 1) << toon.said;
    const Shaded chosen = surface("float d = luminance(diffuse(N)); Oi = 1;\n"
                                  "Ci = Cs * (d > 0.5 ? 1 : 0.25);");
    EXPECT_EQ(chosen("emission.radiance").x, 0.25f);
    EXPECT_EQ(chosen("diffuse.diffuseReflectance").x, 0.75f);
    const Shaded stepped = surface("float d = luminance(diffuse(N)), k = 0.125; Oi = 1;\n"
                                   "if (d > 0.25) k += 0.25; if (d > 0.75) k += 0.5; if (d > 2) k += 1;\n"
                                   "Ci = k * Cs;");
    EXPECT_NEAR(stepped("emission.radiance").x, 0.125f, 1e-6);
    EXPECT_NEAR(stepped("diffuse.diffuseReflectance").x, 0.75f, 1e-6);
    const Shaded ramp =
        surface("float d = luminance(diffuse(N)); Oi = 1; Ci = color texture(\"ramp.tx\", d, 0.5);");
    EXPECT_NEAR(ramp("diffuse.diffuseReflectance").x, 1, 1e-5); // (s, t, 0.25) at s = 1
    EXPECT_NEAR(ramp("diffuse.diffuseReflectance").y, 0.5f, 1e-5);
}

TEST(SlFunctionsOfLight, ArraysAndOpacityHoldLight) {
    const Shaded s = surface("color c[3]; float i; for (i = 0; i < 3; i += 1) c[i] = 0.25 * i * diffuse(N);\n"
                             "Oi = 1; Ci = c[1] + c[2];");
    EXPECT_NEAR(s("diffuse.diffuseReflectance").x, 0.75f, 1e-6);
    EXPECT_EQ(s.said, "");
    const Shaded glow = surface("Ci = 0.5 * diffuse(N); Oi = Ci;");
    EXPECT_NEAR(glow("presence").x, 0.5f, 1e-6);
}

// ---- what published shaders ask for

// A volume shader asks each light at each step of its march; where some lanes leave a loop the others go on.
TEST(SlLight, VolumeShadersFindLightOnTheirWay) {
    struct Lamps : TestServices {
        int lights() override { return 3; }
        void light(const LightRequest& q) override {
            for (int i = 0; i < q.count; i++) {
                q.L[0][i] = 0, q.L[1][i] = 0, q.L[2][i] = q.light == 1 ? -1.0f : 1.0f; // the second is below
                q.Cl[0][i] = q.P[0][i] + 1, q.Cl[1][i] = float(q.light), q.Cl[2][i] = 1;
            }
        }
    };
    const char* source = R"(volume v(float steps = 4;) {
        color all = 0, above = 0; float i, first = 0;
        for (i = 0; i < steps; i += 1) {
            point here = P + i * vector(1, 0, 0);
            illuminance (here) { all += Cl; }
            illuminance (here, vector(0, 0, 1), PI / 2) {
                above += Cl;
                if (u > 0.5) break;
                first += 1;
            }
        }
        Ci = color(comp(all, 0), comp(above, 1), first) + 0.5 * Ci;
    })";
    for (const Config c : configs()) {
        Lamps services;
        Journal journal;
        const auto shader = compile(source, c, &journal);
        ASSERT_TRUE(shader && journal.entries().empty()) << messages(journal);
        const auto instance = shader->instantiate({}, services);
        grid::Grid g = plane(8, 5);
        GridGlobals globals;
        globals.Cs = Vec3f(2, 2, 2);
        const Filtered f = instance->filter(g, globals, services);
        for (int v = 0; v < g.vertices(); v++) {
            const double x = double(g.P[size_t(v)]), u = double(v % 9) / 8;
            const auto Ci = [&](int k) { return double(f.Ci[size_t(k * g.stride + v)]); };
            EXPECT_NEAR(Ci(0), 1 + 3 * (4 * (x + 1) + 6), 1e-4) << v; // three lights at four places
            EXPECT_NEAR(Ci(1), 1 + (u > 0.5 ? 0 : 4 * 2), 1e-5)
                << v; // 0 and 2 are above; left after the first
            EXPECT_NEAR(Ci(2), 1 + (u > 0.5 ? 0 : 4 * 2), 1e-5) << v;
        }
    }
}

TEST(SlLight, EveryWayToLightIsAccepted) {
    const std::pair<const char*, const char*> ways[] = {
        {"ambient()", "ambient"},
        {"diffuse(N) + 0 * ambient()", "diffuse.diffuseReflectance"},
        {"diffuse(N)", "diffuse.diffuseReflectance"},
        {"subsurface(P, N, \"scattering\", color(1))", "diffuse.diffuseReflectance"},
        {"specular(N, -I, 0.5)", "specular.height"},
        {"phong(N, -I, 1)", "specular.height"},
        {"trace(P, reflect(I, N))", "mirror.reflectance"},
        {"trace(P, reflect(normalize(I), N), \"samplecone\", 0.1)", "mirror.reflectance"},
        {"color trace(P, reflect(normalize(I), N), 0.1)", "mirror.reflectance"},
        {"color environment(\"a.env\", vtransform(\"world\", reflect(I, N)), \"blur\", 0.1)",
         "mirror.reflectance"},
        {"color environment(\"a.env\", refract(normalize(I), N, 0.7))", "glass.transmittance"},
        {"(1 - occlusion(P, N, 16, \"maxdist\", 10)) * diffuse(N)", "diffuse.diffuseReflectance"},
        {"(1 - occlusion(\"a.ptc\", P, N, \"hitsides\", \"both\")) * diffuse(N)",
         "diffuse.diffuseReflectance"},
        {"diffuse(N) + indirectdiffuse(P, N, 16, \"maxdist\", 1)", "diffuse.diffuseReflectance"},
        {"indirectdiffuse(\"a.ptc\", P, N, \"hitsides\", \"both\")", "diffuse.diffuseReflectance"},
        {"diffuse(N) * transmission(P, P + N)", "diffuse.diffuseReflectance"},
        {"diffuse(N) + photonmap(\"a.ph\", P, N) + caustic(P, N)", "diffuse.diffuseReflectance"},
        {"diffuse(N) * (1 - shadow(\"a.shd\", P, \"bias\", 0.1))", "diffuse.diffuseReflectance"},
        {"diffuse(N) * (color(1) - color shadow(\"a.shd\", P))", "diffuse.diffuseReflectance"},
        {"diffuse(N) * (raylevel() + isshadowray() + 1)", "diffuse.diffuseReflectance"},
        {"diffuse(N) * ((float trace(P, N)) > 100 ? 1 : 0)", "diffuse.diffuseReflectance"},
    };
    for (const auto& [expression, where] : ways) {
        const Shaded s = surface("Oi = 1; Ci = " + std::string(expression) + ";");
        EXPECT_EQ(s(where, 10), Vec3f(1, 1, 1)) << expression << "\n" << s.said;
    }
    const Shaded ray = surface("string type = \"x\"; float depth = 3; vector d = 0; rayinfo(\"type\", type); "
                               "rayinfo(\"depth\", depth);\n"
                               "Oi = 1; Ci = diffuse(N) * (type == \"camera\" && depth == 0 ? 0.5 : 0.25);");
    EXPECT_EQ(ray("diffuse.diffuseReflectance").x, 0.5f);
    // Directions that no view goes into are lobes of their own; in a loop there are too many.
    const Shaded away = surface("Oi = 1; Ci = trace(P, N) + 0.5 * trace(P, vector(1, 2, 3));");
    EXPECT_EQ(away("trace.part").x, 1);
    EXPECT_EQ(away("trace2.part").x, 0.5f);
    EXPECT_EQ(away("trace2.z").x, 3);
    EXPECT_EQ(away.warnings("Taken as diffuse()"), 0);
    const Shaded many =
        surface("Oi = 1; Ci = 0; float i; for (i = 0; i < 4; i += 1) Ci += 0.25 * trace(P, N + i * dPdu);");
    EXPECT_EQ(many("diffuse.diffuseReflectance").x, 1);
    EXPECT_EQ(many.warnings("Taken as diffuse()"), 1);
}

TEST(SlLight, GatherMissesUnlessItMirrors) {
    const Shaded occluded = surface("float hits = 0, misses = 0; gather(\"illuminance\", P, N, PI / 2, 16, "
                                    "\"distribution\", \"cosine\") { hits += 1; } else { misses += 1; }\n"
                                    "Oi = 1; Ci = diffuse(N) * misses / 16 + color(hits);");
    EXPECT_EQ(occluded("diffuse.diffuseReflectance").x, 1);
    EXPECT_EQ(occluded.lobes(), std::vector{LobeId::LambertBrdf}); // no hits
    const Shaded mirror =
        surface("color hit = 0, sum = 0; float n = 8; vector R = reflect(normalize(I), normalize(N));\n"
                "gather(\"illuminance\", P, R, 0.1, n, \"surface:Ci\", hit) { sum += hit; }\n"
                "Oi = 1; Ci = 0.5 * sum / n;");
    EXPECT_NEAR(mirror("mirror.reflectance").x, 0.5f, 1e-6);
}

TEST(SlLight, ABumpedNormalOfALobeIsTheSurfaces) {
    const auto normal = [](const std::string& body) {
        const auto shader = compile("surface s() {" + body + "}");
        if (!shader)
            return Vec3f(0, 0, 0);
        TestServices services;
        const auto i = shader->instantiate({}, services);
        grid::Grid g = plane(8, 5);
        grid::VertexInputs out;
        GridGlobals globals;
        globals.E = Vec3f(1, 0.5f, 2);
        i->shade(g, globals, services, out);
        return g.normal(3);
    };
    const std::string bump = "normal Nb = calculatenormal(P + normalize(N) * 0.3 * u); Oi = 1;";
    const Vec3f bumped = normalize(normal(bump + "Ci = diffuse(faceforward(normalize(Nb), I));"));
    EXPECT_LT(bumped.x, -0.1f);
    EXPECT_NEAR(normalize(normal(bump + "Ci = specular(normalize(Nb), -I, 0.1) + diffuse(N);")).x, bumped.x,
                1e-5);
    EXPECT_EQ(
        normal("Oi = 1; normal Nf = faceforward(normalize(N), I); Ci = diffuse(Nf) + specular(Nf, -I, 0.1);")
            .x,
        0);
    EXPECT_NEAR(
        normalize(normal(bump + "illuminance(P, Nb, PI / 2) Ci += Cl * (normalize(L) . normalize(Nb));")).x,
        bumped.x, 1e-5);
}

TEST(SlLight, LobesFitIntoAMaterial) {
    std::string sum;
    for (int i = 0; i < 30; i++)
        sum += " + 0.01 * specular(N, -I, 0.1)";
    const Shaded s = surface("Oi = 1; Ci = 0.25 * Cs + diffuse(N) + trace(P, reflect(I, N))" + sum + ";");
    EXPECT_EQ(s.lobes().size(), 15u);
    EXPECT_LE(s.instance->program().nodes.size(), 32u);
    EXPECT_NEAR(s("specular12.height").x, 0.19f, 1e-5);
    EXPECT_EQ(surface("Oi = 1; Ci = 0;").lobes(), std::vector{LobeId::LambertBrdf}); // black
}

TEST(SlLight, SurfacesThatSetNothing) {
    GridGlobals globals;
    globals.Cs = Vec3f(0.8f, 0.6f, 0.4f);
    globals.Os = Vec3f(0.5f, 0.5f, 0.5f);
    const Shaded null = shade("surface null() {}", {}, globals);
    EXPECT_EQ(null.lobes(), std::vector{LobeId::DiffuseEmission});
    EXPECT_NEAR(null("emission.radiance").x, 0.8f, 1e-6);
    EXPECT_NEAR(null("presence").x, 0.5f, 1e-6);
    const Shaded gone = shade("surface gone() { Oi = 0; Ci = diffuse(N); }", {}, globals);
    EXPECT_EQ(gone("presence").x, 0);
    EXPECT_EQ(gone("diffuse.diffuseReflectance").x, 0);
    EXPECT_EQ(shade("surface hole() { Oi = 0; }", {}, globals)("presence").x, 0);
}

TEST(SlLight, GlowNeedsNoOpacity) {
    GridGlobals globals;
    // What is seen is presence times radiance: Ci, whatever Oi is.
    for (const char* source : {"surface glow() { Oi = 0; Ci = color(0.25, 0.5, 1); }",
                               "surface glow() { Oi = color(0.5, 0.25, 0); Ci = color(0.25, 0.5, 1); }",
                               "surface glow() { Oi = 0.01; Ci = color(0.25, 0.5, 1); }"}) {
        const Shaded s = shade(source, {}, globals);
        const float p = s("presence").x;
        EXPECT_GE(p, 1 / 16.f) << source;
        EXPECT_LE(p, 0.25f) << source;
        for (int c = 0; c < 3; c++)
            EXPECT_NEAR(s("emission.radiance")[c] * p, 0.25f * float(1 << c), 1e-6f) << source;
    }
    // Where there is no glow there is a hole.
    EXPECT_EQ(shade("surface dark() { Oi = 0; Ci = color(u > 2 ? 1 : 0); }", {}, globals)("presence").x, 0);
    // An opaque surface that glows needs no presence.
    EXPECT_NEAR(shade("surface lamp() { Oi = Os; Ci = Os * (Cs * diffuse(N) + color(0, 0, u)); }", {},
                      globals)("presence")
                    .x,
                1, 1e-6f);
}

// Seen from above and from below, that is with the normal towards the eye and away from it: what follows from
// the mirrored direction is the same. The oracle is I - 2 (I . n) n with n towards the eye.
TEST(SlLight, FaceforwardTurnsNormalsOfReversedSurfaces) {
    for (const float side : {1.0f, -1.0f})
        for (const std::string body :
             {"vector R = I - 2 * (I . Nf) * Nf;", "vector R = I - (I . Nf) * 2 * Nf;",
              "float c = 2 * (I . Nf); vector R = I; R -= c * Nf;", "vector R = reflect(I, Nf);",
              "vector R = I + 2 * (-I . Nf) * Nf;", "vector R = I - 2 * (I . -Nf) * -Nf;"})
            for (const std::string n : {"faceforward(normalize(N), I)", "faceforward(-normalize(N), I)"}) {
                const auto shader =
                    compile("surface s() { normal Nf = " + n + "; " + body +
                            " Ci = color(xcomp(R), ycomp(R), zcomp(R)) * 0.1 + 0.5; Oi = 1; }");
                ASSERT_TRUE(shader);
                TestServices services;
                const auto instance = shader->instantiate({}, services);
                grid::Grid g = plane(8, 5);
                GridGlobals globals;
                globals.E = Vec3f(1, 0.5f, 2 * side);
                grid::VertexInputs out;
                instance->shade(g, globals, services, out);
                const int radiance = slot(instance->program(), "emission.radiance");
                ASSERT_GE(radiance, 0);
                for (int k = 0; k < g.vertices(); k++) {
                    const Vec3f i = g.position(k) - globals.E, turned(0, 0, side);
                    const Vec3f expected = (i - turned * (2 * dot(i, turned))) * 0.1f + Vec3f(0.5f);
                    EXPECT_NEAR(length(value(out, radiance, k) - expected), 0, 1e-5f) << body << n << side;
                }
            }
}

TEST(SlLight, DiffuseOfTheOtherSideComesThrough) {
    for (const std::string n : {"-Nf", "-N", "-normalize(N)", "-faceforward(N, I)"}) {
        const Shaded s = surface("normal Nf = faceforward(normalize(N), I); Oi = 1;"
                                 "Ci = color(0.1, 0.2, 0.3) * diffuse(Nf) + color(0.4, 0.3, 0.2) * diffuse(" +
                                 n + ");");
        EXPECT_EQ(s.lobes(), (std::vector{LobeId::LambertBrdf, LobeId::LambertBtdf})) << n << s.said;
        EXPECT_NEAR(length(s("diffuse.diffuseReflectance") - Vec3f(0.1f, 0.2f, 0.3f)), 0, 1e-6f) << n;
        EXPECT_NEAR(length(s("transmission.diffuseTransmittance") - Vec3f(0.4f, 0.3f, 0.2f)), 0, 1e-6f) << n;
        EXPECT_EQ(s.said, "");
    }
    // In a loop of its own.
    const Shaded loop = surface("normal Nf = faceforward(normalize(N), I); Oi = 1; Ci = 0;"
                                "illuminance(P, -Nf, PI / 2) Ci += 0.3 * Cl * (normalize(L) . -Nf);");
    EXPECT_EQ(loop.lobes(), std::vector{LobeId::LambertBtdf}) << loop.said;
    EXPECT_NEAR(loop("transmission.diffuseTransmittance").x, 0.3f, 1e-6f);
    // A normal that pointed inwards before is turned to the outside; one that a shader turns to the eye is
    // what faceforward() would give.
    const Shaded cross = surface("normal n = normal(dPdv ^ dPdu); Oi = 1; Ci = 0.3 * diffuse(-n);");
    EXPECT_NEAR(cross("diffuse.diffuseReflectance").x, 0.3f, 1e-6f);
    EXPECT_LE(cross("transmission.diffuseTransmittance").x, 0);
    const Shaded by_hand =
        surface("normal n = normalize(N); if (n . I > 0) n = -n; Oi = 1; Ci = 0.3 * diffuse(n);");
    EXPECT_EQ(by_hand.lobes(), std::vector{LobeId::LambertBrdf}) << by_hand.said;
}

TEST(SlLight, MovingPInASurfaceIsTold) {
    const Shaded s = surface("P += 0.3 * u * normalize(N); N = calculatenormal(P); Oi = 1; Ci = diffuse(N);");
    EXPECT_EQ(s.warnings("only a displacement shader moves the surface"), 1) << s.said;
    EXPECT_EQ(surface("point Q = P; Q += 1; Oi = 1; Ci = diffuse(N) * xcomp(Q);").said, "");
}

} // namespace kanuka::sl::test
