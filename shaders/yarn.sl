// Yarn: fibres that are spun along it. Dull colour, a sheen of fibres that stand off, a gloss across the spin.
class yarn(
    float sheen = 0.25;     // weight of the fibres that stand off
    float gloss = 0.15;     // weight of the reflection along the fibres: silk has more, wool less
    float roughness = 0.45; // along the yarn
    float twist = 0.05;     // turns between the yarn and its fibres
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "sheen", SheenBrdf());
        AddLobe(boundary, "gloss", MicrofacetConductorBrdf());
        AddLobe(boundary, "body", OrenNayarBrdf());
        AddLayer(boundary, "thread", "mix", "gloss", "body");
        AddLayer(boundary, "yarn", "coat", "sheen", "thread"); // what stands off takes light from what lies below
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SheenBrdf stray = SheenBrdf("reflectance", mix(Cs, color(1), 0.2), "roughness", 0.4);
        MicrofacetConductorBrdf fibres = MicrofacetConductorBrdf("reflectance", mix(Cs, color(1), 0.3), "roughness",
            roughness, "anisotropy", 0.7, "rotation", 0.25 + twist);
        OrenNayarBrdf body = OrenNayarBrdf("diffuseReflectance", Cs, "roughness", 0.7);
        SetLobe(boundary, "sheen", sheen, stray);
        SetLobe(boundary, "gloss", 1.0, fibres);
        SetLobe(boundary, "body", 1.0, body);
        SetLayer(boundary, "thread", gloss);
    }
}
