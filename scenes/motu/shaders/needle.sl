// Needles and grass: thin, dull, some light goes through.
class needle(
    color tone = color(0.16, 0.2, 0.07); // reflectance; what goes through is yellower
    float transmission = 0.35;           // part of the light that goes to the other side
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "reflection", LambertBrdf());
        AddLobe(boundary, "transmission", LambertBtdf());
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        color passing = tone * color(1.5, 1.35, 0.7);
        SetLobe(boundary, "reflection", 1 - transmission, LambertBrdf("diffuseReflectance", tone));
        SetLobe(boundary, "transmission", transmission, LambertBtdf("diffuseTransmittance", passing));
    }
}
