// Hair and fur, as ribbons turned to the camera. A strand is a cylinder: rough across, smooth along, so that its gloss
// is anisotropic; light goes through it as well as back, less what its surface reflects. Cs is its colour, as `hair` of
// the procedurals gives it.
class hair(
    float gloss = 0.6;                 // weight of the clear reflection off the surface
    float tinted = 0.5;                // weight of the reflection from inside, in the hair's colour
    float roughness = 0.35;            // along the strand
    float transmission = 0.45;         // part of the diffuse light that goes to the other side
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "surface", MicrofacetConductorBrdf());
        AddLobe(boundary, "inside", MicrofacetConductorBrdf());
        AddLobe(boundary, "reflection", LambertBrdf());
        AddLobe(boundary, "transmission", LambertBtdf());
        AddLayer(boundary, "spread", "mix", "transmission", "reflection");
        AddLayer(boundary, "core", "mix", "inside", "spread");
        AddLayer(boundary, "strand", "coat", "surface", "core");
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        color deep = sqrt(Cs) * Cs;
        MicrofacetConductorBrdf clear = MicrofacetConductorBrdf("reflectance", color(0.05), "roughness", roughness,
            "anisotropy", 0.75, "rotation", 0.25);
        MicrofacetConductorBrdf dyed = MicrofacetConductorBrdf("reflectance", Cs, "roughness",
            min(1, 1.6 * roughness), "anisotropy", 0.6, "rotation", 0.25);
        LambertBrdf back = LambertBrdf("diffuseReflectance", Cs);
        LambertBtdf through = LambertBtdf("diffuseTransmittance", deep);
        SetLobe(boundary, "surface", gloss, clear);
        SetLobe(boundary, "inside", 1.0, dyed);
        SetLobe(boundary, "reflection", 1.0, back);
        SetLobe(boundary, "transmission", 1.0, through);
        SetLayer(boundary, "spread", transmission);
        SetLayer(boundary, "core", 0.25 * tinted);
    }
}
