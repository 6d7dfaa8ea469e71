#include <thread>

#include "sl/test_support.h"

namespace kanuka::sl::test {

TEST(Sl, ClassShaderWithAllStages) {
    const char* source = R"(
float fractal(point p; float octaves) {
    float sum = 0, amp = 1; point q = p; float i;
    for (i = 0; i < octaves; i += 1) { sum += amp * snoise(q); amp *= 0.5; q *= 2; }
    return sum;
}
class rock(float height = 0.1; color tint = color(1, 0.5, 0.25); float usecoat = 0;) {
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material) {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "base", LambertBrdf());
        if (usecoat > 0) AddLobe(boundary, "coat", MicrofacetDielectricBrdf("ior", 1.3));
    }
    public void mnk_displacement(output point P; output normal N) {
        P += normalize(N) * height * fractal(P * 4, 4);
        N = normalize(calculatenormal(P));
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary) {
        LambertBrdf l = LambertBrdf("diffuseReflectance", tint * (0.5 + 0.5 * noise(P * 8)));
        SetLobe(boundary, "base", 0.5, l);
    }
})";
    for (const Config c : configs()) {
        const auto shader = compile(source, c);
        ASSERT_TRUE(shader);
        EXPECT_EQ(shader->name(), "rock");
        TestServices services;
        const std::vector<Argument> args = {{"usecoat", {1}, {}, false}};
        const auto instance = shader->instantiate(args, services);
        const auto plainer = shader->instantiate({}, services);
        EXPECT_EQ(plainer->program().nodes.size(), 1u);
        ASSERT_EQ(instance->program().nodes.size(), 3u);
        EXPECT_EQ(instance->program().nodes[2].op, grid::LayerOp::Add);
        EXPECT_TRUE(instance->displaces());
        grid::Grid g = plane(16, 12);
        instance->displace(g, {}, services);
        double moved = 0;
        for (int i = 0; i < g.vertices(); i++) {
            moved += std::abs(g.position(i).z);
            EXPECT_NEAR(length(g.normal(i)), 1, 1e-5);
        }
        EXPECT_GT(moved, 0.1);
        grid::VertexInputs out;
        instance->shade(g, {}, services, out);
        const int base = slot(instance->program(), "base.diffuseReflectance");
        ASSERT_GE(base, 0);
        const Vec3f v = value(out, base, 5);
        EXPECT_NEAR(v.y / v.x, 0.5f, 1e-4);
        EXPECT_GT(v.x, 0.4f);
        EXPECT_TRUE(services.reports.empty()) << services.reports[0];
    }
}

TEST(Sl, MatteAndPlastic) {
    const char* matte = R"(surface matte(float Ka = 1, Kd = 0.5;) {
        normal Nf = faceforward(normalize(N), I);
        Oi = Os; Ci = Os * Cs * (Ka * ambient() + Kd * diffuse(Nf)); })";
    const char* plastic =
        R"(surface plastic(float Ka = 1, Kd = .5, Ks = .5, roughness = .1; color specularcolor = 1;) {
        normal Nf = faceforward(normalize(N), I); vector V = -normalize(I);
        Oi = Os;
        Ci = Os * (Cs * (Ka * ambient() + Kd * diffuse(Nf)) + specularcolor * Ks * specular(Nf, V, roughness)); })";
    const char* constant = "surface constant() { Oi = Os; Ci = Os * Cs; }";
    TestServices services;
    GridGlobals globals;
    globals.Cs = Vec3f(0.8f, 0.6f, 0.4f);
    globals.Os = Vec3f(0.5f, 0.5f, 0.5f);
    for (const Config c : configs()) {
        grid::Grid g = plane(4, 4);
        grid::VertexInputs out;
        auto i = compile(matte, c)->instantiate({}, services);
        ASSERT_EQ(i->program().nodes.size(), 1u);
        EXPECT_EQ(i->program().nodes[0].lobe, grid::LobeId::LambertBrdf);
        EXPECT_EQ(i->program().nodes[0].weight, -1);
        EXPECT_TRUE(i->uniform_material(false));
        EXPECT_FALSE(i->uniform_material());
        i->shade(g, globals, services, out);
        const Vec3f v = value(out, slot(i->program(), "diffuse.diffuseReflectance"), 0);
        EXPECT_NEAR(v.x, 0.4f, 1e-6);
        EXPECT_NEAR(v.z, 0.2f, 1e-6);
        EXPECT_NEAR(value(out, i->program().presence, 0).x, 0.5f, 1e-6);

        i = compile(plastic, c)->instantiate({}, services);
        ASSERT_EQ(i->program().nodes.size(), 3u);
        i->shade(g, globals, services, out);
        EXPECT_EQ(value(out, slot(i->program(), "specular.height"), 0).x, 0.5f);
        EXPECT_NEAR(value(out, slot(i->program(), "specular.exponent"), 0).x, 8 / 0.1, 1e-4);

        i = compile(constant, c)->instantiate({}, services);
        ASSERT_EQ(i->program().nodes.size(), 1u);
        EXPECT_EQ(i->program().nodes[0].lobe, grid::LobeId::DiffuseEmission);
        i->shade(g, globals, services, out);
        EXPECT_NEAR(value(out, slot(i->program(), "emission.radiance"), 0).y, 0.6f, 1e-6);
    }
}

// Grids are independent, also while variants are being compiled.
TEST(Sl, ThreadsShareAnInstance) {
    const auto shader =
        compile("surface s(float Kd = 1;) { Oi = Os; Ci = Os * Cs * Kd * noise(P * 5) * diffuse(N); }");
    TestServices services;
    const auto instance = shader->instantiate({}, services);
    std::vector<std::vector<float>> results(8);
    std::vector<std::thread> threads;
    for (size_t k = 0; k < results.size(); k++)
        threads.emplace_back([&, k] {
            grid::Grid g = plane(16, 16);
            if (k % 2) { // the same colours, as a primvar
                g.primvars.push_back({"Cs", 3, g.stride, std::vector<float>(size_t(g.stride) * 3, 1.0f)});
            }
            grid::VertexInputs out;
            for (int n = 0; n < 20; n++)
                instance->shade(g, {}, services, out);
            results[k] = out.slots[size_t(slot(instance->program(), "diffuse.diffuseReflectance"))].data;
            results[k].resize(size_t(g.vertices()));
        });
    for (std::thread& t : threads)
        t.join();
    for (const auto& r : results)
        EXPECT_EQ(r, results[0]);
}

} // namespace kanuka::sl::test
