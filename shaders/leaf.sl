// A thin sheet that light passes: leaves, paper, cloth.
class leaf(
    varying color front = color(0.15, 0.30, 0.06);   // reflectance
    varying color through = color(0.30, 0.45, 0.05); // transmittance
    float transmission = 0.4;                // part of the light that goes to the other side
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
        LambertBrdf reflection = LambertBrdf("diffuseReflectance", front);
        LambertBtdf passing = LambertBtdf("diffuseTransmittance", through);
        SetLobe(boundary, "reflection", 1 - transmission, reflection);
        SetLobe(boundary, "transmission", transmission, passing);
    }
}
