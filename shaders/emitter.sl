// A surface that shines alike in all directions.
class emitter(
    color radiance = 1; // W/(sr m^2), D65 = (1, 1, 1)
    float exposure = 0; // doubles the radiance with every step
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "light", DiffuseEmission());
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        DiffuseEmission glow = DiffuseEmission("radiance", radiance * pow(2, exposure));
        SetLobe(boundary, "light", 1.0, glow);
    }
}
