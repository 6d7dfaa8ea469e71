// MicrofacetConductorBrdf: edge tint, grooves and tail. Expect anisotropy u, rotation v, a tail at its end of 0.6.
class lobe_conductor_shape()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", MicrofacetConductorBrdf("edgeTint", color(0.8, 0.9, 1)));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, MicrofacetConductorBrdf("anisotropy", u, "rotation", v, "tail", 5));
    }
}
