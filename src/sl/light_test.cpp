// Classic surfaces that do more to light and to the view than a material can: what is kept of them, and what
// is said about it.
#include "sl/test_light.h"

namespace kanuka::sl::test {

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

} // namespace kanuka::sl::test
