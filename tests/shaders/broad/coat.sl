// A rough coat that absorbs, over white.
class coat()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "upper", MicrofacetDielectricBrdf("ior", 1.45));
        AddLobe(b, "lower", LambertBrdf());
        AddLayer(b, "coated", "coat", "upper", "lower");
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "upper", 1, MicrofacetDielectricBrdf("roughness", 0.7, "transmittance", color(0.9, u, 0.3)));
        SetLobe(b, "lower", 1, LambertBrdf());
    }
}
