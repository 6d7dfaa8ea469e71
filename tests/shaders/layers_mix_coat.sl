// Layers: a coat over a mixture of two lobes. Expect the tree's weights: 0.5 and u.
class layers_mix_coat()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "varnish", MicrofacetDielectricBrdf("roughness", 0.05));
        AddLobe(b, "flakes", MicrofacetConductorBrdf());
        AddLobe(b, "paint", LambertBrdf());
        AddLayer(b, "base", "mix", "flakes", "paint");
        AddLayer(b, "coated", "coat", "varnish", "base");
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "paint", 1, LambertBrdf("diffuseReflectance", color(0.2, 0.3, v)));
        SetLobe(b, "flakes", 1, MicrofacetConductorBrdf("roughness", 0.3 + 0.2 * u));
        SetLayer(b, "base", u);
        SetLayer(b, "coated", 0.5);
    }
}
