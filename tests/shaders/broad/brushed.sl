// Stretched highlights with long tails.
class brushed()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", MicrofacetConductorBrdf("edgeTint", color(0.8, 0.9, 1)));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, MicrofacetConductorBrdf("roughness", 0.75, "anisotropy", 0.5 * u, "rotation", v, "tail", 5));
    }
}
