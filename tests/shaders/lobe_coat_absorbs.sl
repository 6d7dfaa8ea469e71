// MicrofacetDielectricBrdf: a layer that absorbs. Expect transmittance 0.9, u, 0.3.
class lobe_coat_absorbs()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", MicrofacetDielectricBrdf("ior", 1.45));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, MicrofacetDielectricBrdf("transmittance", color(0.9, u, 0.3)));
    }
}
