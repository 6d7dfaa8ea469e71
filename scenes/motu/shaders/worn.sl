// What is worn smooth: pebbles, shells, nuts. A body under a dull gloss.
class worn(
    color tone = color(0.4, 0.36, 0.3); // reflectance
    float roughness = 0.5;              // of the gloss
    float gloss = 0.6;                  // weight of it
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "gloss", MicrofacetDielectricBrdf("ior", 1.5));
        AddLobe(boundary, "body", LambertBrdf());
        AddLayer(boundary, "all", "coat", "gloss", "body");
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SetLobe(boundary, "gloss", gloss, MicrofacetDielectricBrdf("ior", 1.5, "roughness", roughness));
        SetLobe(boundary, "body", 1, LambertBrdf("diffuseReflectance", tone));
    }
}
