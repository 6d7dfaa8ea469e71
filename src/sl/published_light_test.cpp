// What published shaders ask of light.
#include "sl/test_light.h"

namespace kanuka::sl::test {

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
