// What an interface reflects, and nothing else.
class gloss(float ior = 1.5; float roughness = 0; float tail = 0.5;)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "gloss", MicrofacetDielectricBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SetLobe(boundary, "gloss", 1, MicrofacetDielectricBrdf("ior", ior, "roughness", roughness, "tail", tail));
    }
}
