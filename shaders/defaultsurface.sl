// What has no surface of its own: as if lit from the eye, so that shapes show without any light.
class defaultsurface(
    float Ka = 0.2; // of Cs
    float Kd = 0.8; // of Cs, too: where it faces the eye it shows their sum, less the more it turns away
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "eye", ProfileEmission());
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        ProfileEmission eye = ProfileEmission("radiance", (Ka + Kd) * Cs, "exponent", 1);
        SetLobe(boundary, "eye", 1.0, eye);
    }
}
