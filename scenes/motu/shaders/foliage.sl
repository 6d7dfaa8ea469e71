// A leaf: light that comes back, light that goes through, and the gleam of its skin. Ribs and spots by (s, t) and noise.
class foliage(
    color front = color(0.12, 0.24, 0.04);   // reflectance
    color through = color(0.24, 0.40, 0.05); // transmittance
    float transmission = 0.4;                // part of the diffuse light that goes to the other side
    float gleam = 0.55;                      // weight of the gloss
    float roughness = 0.42;                  // of the skin
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "skin", MicrofacetDielectricBrdf("ior", 1.42));
        AddLobe(boundary, "reflection", LambertBrdf());
        AddLobe(boundary, "transmission", LambertBtdf());
        AddLayer(boundary, "flesh", "mix", "transmission", "reflection");
        AddLayer(boundary, "leaf", "coat", "skin", "flesh");
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SetLobe(boundary, "skin", gleam, MicrofacetDielectricBrdf("ior", 1.42, "roughness", roughness));
        SetLobe(boundary, "reflection", 1, LambertBrdf("diffuseReflectance", front));
        SetLobe(boundary, "transmission", 1, LambertBtdf("diffuseTransmittance", through));
        SetLayer(boundary, "flesh", transmission);
    }
}
