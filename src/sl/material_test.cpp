// Materials: the specification's listings, and layers.
#include "sl/test_materials.h"

namespace kanuka::sl::test {

TEST(SlMaterial, SpecificationListings) {
    // The listings of the shading language's specification, with the functions and parameters that they name.
    const char* two_lobes = R"(
float mydisplacement() { return noise(P * 3); }
float mybump() { return noise(P * 30); }
class listing(float height = 0.1, bumpheight = 0.01;) {
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "reflection", LambertBrdf());
        AddLobe(boundary, "transmission", LambertBtdf());
    }
    public void mnk_prelighting(MnkMaterialBoundary boundary)
    {
        LambertBrdf reflection = LambertBrdf("diffuseReflectance", color(1.0, 0, 0));
        LambertBtdf transmission = LambertBtdf("diffuseTransmittance", color(0, 1.0, 0));
        SetLobe(boundary, "reflection", 0.25, reflection);
        SetLobe(boundary, "transmission", 0.75, transmission);
    }
    public void mnk_displacement(output point P; output normal N)
    {
        P += normalize(N) * height * mydisplacement();
        N = normalize(calculatenormal(P));
        point Pbump = P + N * bumpheight * mybump();
        N = normalize(calculatenormal(Pbump));
    }
})";
    TestServices services;
    auto i = make(two_lobes, services);
    ASSERT_TRUE(i);
    EXPECT_EQ(lobes(i->program()), (std::vector{LobeId::LambertBrdf, LobeId::LambertBtdf}));
    EXPECT_TRUE(i->uniform_material());
    grid::Grid g = plane(32, 32);
    i->displace(g, {}, services);
    float low = 1, high = 0;
    for (int k = 0; k < g.vertices(); k++) {
        low = std::min(low, g.position(k).z);
        high = std::max(high, g.position(k).z);
        EXPECT_NEAR(length(g.normal(k)), 1, 1e-5);
    }
    EXPECT_GT(high - low, 0.01f);
    grid::VertexInputs out;
    i->shade(g, {}, services, out);
    EXPECT_EQ(value(out, slot(i->program(), "reflection.weight"), 0).x, 0.25f);
    EXPECT_EQ(value(out, slot(i->program(), "transmission.weight"), 0).x, 0.75f);
    EXPECT_EQ(value(out, slot(i->program(), "reflection.diffuseReflectance"), 0), Vec3f(1, 0, 0));
    EXPECT_EQ(value(out, slot(i->program(), "transmission.diffuseTransmittance"), 0), Vec3f(0, 1, 0));

    const char* interior = R"(
class glass(float ior = 1.4, roughness = 0.3;) {
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "bsdf", MicrosurfaceDielectricBsdfRgb_v1("ior", ior));
        MnkMaterialInterior interior = CreateInterior(material, "homogeneous", ior);
        AddPhaseFunction(interior, "pf", HenyeyGreensteinPfrgb());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        MicrosurfaceDielectricBsdfRgb_v1 params = MicrosurfaceDielectricBsdfRgb_v1("roughness", color(roughness));
        SetLobe(boundary, "bsdf", 1.0, params);
    }
    public void mnk_interior(output MnkMaterialInterior interior)
    {
        HenyeyGreensteinPfrgb pf = HenyeyGreensteinPfrgb("meanCosine", color(0));
        SetAbsorption(interior, color(0, 1, 2));
        SetScattering(interior, color(3));
        SetPhaseFunction(interior, "pf", HenyeyGreensteinPfrgb("meanCosine", color(0.6)));
    }
})";
    const std::vector<Argument> args = {{"ior", {1.7f}, {}, false}};
    i = make(interior, services, args);
    ASSERT_TRUE(i);
    ASSERT_TRUE(i->program().interior);
    EXPECT_FLOAT_EQ(i->program().interior->ior, 1.7f);
    EXPECT_EQ(i->program().interior->absorption, Vec3f(0, 1, 2));
    EXPECT_EQ(i->program().interior->scattering, Vec3f(3, 3, 3));
    EXPECT_EQ(i->program().interior->phase, grid::LobeId::HenyeyGreensteinPfrgb);
    EXPECT_FLOAT_EQ(i->program().interior->phase_inputs[0], 0.6f);
    EXPECT_FLOAT_EQ(i->program().interior->priority, 0);
    i->shade(g, {}, services, out);
    EXPECT_FLOAT_EQ(value(out, slot(i->program(), "bsdf.roughness"), 0).y, 0.3f);
    EXPECT_FLOAT_EQ(value(out, slot(i->program(), "bsdf.ior"), 0).x, 1.7f); // from AddLobe, set no more
    EXPECT_EQ(i->program().nodes[0].weight, -1);
    EXPECT_TRUE(services.reports.empty()) << services.reports[0];
}

// An interior without a boundary: light passes as it comes. One phase function, its inputs within their
// range.
TEST(SlMaterial, InteriorsHavePhaseFunctionsAndPriorities) {
    TestServices services;
    const auto i = make(R"(
class cloud() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialInterior inside = CreateInterior(m, "homogeneous", 1);
        AddPhaseFunction(inside, "pf", DoubleHenyeyGreensteinPfrgb("meanCosine", 0.9, "share", 0.4));
    }
    public void mnk_interior(output MnkMaterialInterior inside) {
        SetScattering(inside, color(1, 2, 3));
        SetAbsorption(inside, color(-1, 0, 0));
        SetPhaseFunction(inside, "pf", DoubleHenyeyGreensteinPfrgb("otherMeanCosine", -7));
        SetPriority(inside, 2.5);
    }
})",
                        services);
    ASSERT_TRUE(i);
    EXPECT_TRUE(i->program().nodes.empty());
    ASSERT_TRUE(i->program().interior);
    const grid::Interior& in = *i->program().interior;
    EXPECT_EQ(in.phase, grid::LobeId::DoubleHenyeyGreensteinPfrgb);
    EXPECT_FLOAT_EQ(in.phase_inputs[0], 0.9f); // from AddPhaseFunction
    EXPECT_FLOAT_EQ(in.phase_inputs[1], -1.0f);
    EXPECT_FLOAT_EQ(in.phase_inputs[2], 0.4f);
    EXPECT_FLOAT_EQ(in.priority, 2.5f);
    EXPECT_EQ(in.absorption, Vec3f(0, 0, 0));
    EXPECT_EQ(in.scattering, Vec3f(1, 2, 3));
    EXPECT_EQ(services.reports.size(), 2u);
}

TEST(SlMaterial, LayersArePostOrderTrees) {
    TestServices services;
    const auto i = make(R"(
class car() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "paint", LambertBrdf());
        AddLobe(b, "flakes", MicrofacetConductorBrdf());
        AddLobe(b, "varnish", MicrofacetDielectricBrdf());
        AddLobe(b, "glow", DiffuseEmission());
        AddLayer(b, "base", "mix", "flakes", "paint");
        AddLayer(b, "coated", "coat", "varnish", "base");
    }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        SetLayer(b, "base", noise(P));
        SetLayer(b, "coated", 0.5);
        SetPresence(b, u);
    }
})",
                        services);
    ASSERT_TRUE(i);
    const auto& n = i->program().nodes;
    ASSERT_EQ(n.size(), 7u);
    for (size_t k = 0; k < n.size(); k++) {
        EXPECT_LT(n[k].upper, int(k));
        EXPECT_LT(n[k].lower, int(k));
    }
    const auto find = [&](const char* name) {
        return std::find_if(n.begin(), n.end(), [&](const auto& x) { return x.name == name; });
    };
    EXPECT_EQ(find("base")->op, LayerOp::Mix);
    EXPECT_EQ(n[size_t(find("base")->upper)].name, "flakes");
    EXPECT_EQ(n[size_t(find("coated")->lower)].name, "base");
    EXPECT_EQ(find("coated")->op, LayerOp::Coat);
    EXPECT_EQ(n.back().op, LayerOp::Add);
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    i->shade(g, {}, services, out);
    EXPECT_FALSE(out.slots[size_t(find("base")->weight)].uniform);
    EXPECT_TRUE(out.slots[size_t(find("coated")->weight)].uniform);
    EXPECT_FLOAT_EQ(value(out, i->program().presence, 4).x, 0.5f);
    EXPECT_TRUE(services.reports.empty()) << services.reports[0];
}

// Of names that are no constants; mistakes in others are errors of the compiler (mistakes_test.cpp).
TEST(SlMaterial, MistakesInMaterialsAreReported) {
    TestServices services;
    make(R"(class bad(string lobe = "a", kind = "glue", other = "nobody") {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, lobe, LambertBrdf());
        AddLobe(b, "a", LambertBrdf());
        AddLayer(b, "l", kind, "a", "a");
        AddLayer(b, "k", "mix", "a", other);
    }
    public void mnk_prelighting(output MnkMaterialBoundary b) { SetLobe(b, "a", 1, DiffuseEmission("radiance", color(1))); }
})",
         services);
    const auto has = [&](const char* text) {
        for (const std::string& r : services.reports)
            if (r.find(text) != std::string::npos)
                return true;
        return false;
    };
    EXPECT_TRUE(has("already has a \"a\""));
    EXPECT_TRUE(has("no layer \"glue\""));
    EXPECT_TRUE(has("\"nobody\""));
    EXPECT_TRUE(has("gives \"a\" a DiffuseEmission"));
}

TEST(SlMaterial, ThickCoatsAndShapesOfEmission) {
    TestServices services;
    const auto good = make(R"(class good() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "varnish", MicrofacetDielectricBrdf("thickness", 2, "absorption", color(0.1, 0.2, 0.3)));
        AddLobe(b, "paint", LambertBrdf());
        AddLobe(b, "glow", ConeEmission("angle", 30));
        AddLayer(b, "all", "thick", "varnish", "paint");
    }
})",
                           services);
    ASSERT_TRUE(good);
    EXPECT_TRUE(services.reports.empty()) << services.reports[0];
    const auto& nodes = good->program().nodes;
    EXPECT_TRUE(
        std::any_of(nodes.begin(), nodes.end(), [](const auto& n) { return n.op == LayerOp::Thick; }));
    ASSERT_TRUE(good->program().emission());
    EXPECT_EQ(good->program().emission()->lobe, LobeId::ConeEmission);
    make(R"(class bad() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "a", MetalBrdf());
        AddLobe(b, "c", LambertBrdf());
        AddLayer(b, "l", "thick", "a", "c");
        AddLobe(b, "d", DiffuseEmission());
        AddLobe(b, "p", ProfileEmission("exponent", 3));
    }
})",
         services);
    const auto has = [&](const char* text) {
        for (const std::string& r : services.reports)
            if (r.find(text) != std::string::npos)
                return true;
        return false;
    };
    EXPECT_TRUE(has("is no MicrofacetDielectricBrdf"));
    EXPECT_TRUE(has("a surface shines in one shape"));
}

TEST(SlMaterial, InputsAreClampedAndNansReplaced) {
    TestServices services;
    const auto i = make(R"(class c() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) { AddLobe(CreateBoundary(m), "a", LambertBrdf()); }
    public void mnk_displacement(output point P; output normal N) { P += N * (u > 0.5 ? log(-1) : 1); }
    public void mnk_prelighting(output MnkMaterialBoundary b) { SetLobe(b, "a", 1, LambertBrdf("diffuseReflectance", color(u * 4 - 1, log(-1 - u), 0.5))); }
})",
                        services);
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    i->shade(g, {}, services, out);
    const int s = slot(i->program(), "a.diffuseReflectance");
    EXPECT_EQ(value(out, s, 0), Vec3f(0, 0, 0.5f));
    EXPECT_EQ(value(out, s, 8), Vec3f(1, 0, 0.5f));
    i->displace(g, {}, services);
    EXPECT_EQ(g.position(0).z, 1);
    EXPECT_EQ(g.position(8).z, 0); // not finite: stays
}

TEST(SlMaterial, MembersGoFromInitAndBeginToTheStages) {
    TestServices services;
    const auto i = make(R"(class c(float k = 3;) {
    float from_init = 0;
    varying float from_begin;
    constant float twice = 2;
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) { AddLobe(CreateBoundary(m), "a", DiffuseEmission()); from_init = k * 2; }
    public void begin() { from_begin = s; }
    public void mnk_prelighting(output MnkMaterialBoundary b) { SetLobe(b, "a", 1, DiffuseEmission("radiance", color(from_begin, from_init, twice))); }
})",
                        services);
    grid::Grid g = plane(8, 5);
    grid::VertexInputs out;
    i->shade(g, {}, services, out);
    EXPECT_EQ(value(out, slot(i->program(), "a.radiance"), 4),
              Vec3f(0.5f, 0, 2)); // initialised members are set anew at begin
}

} // namespace kanuka::sl::test
