// A thin sheet: a quarter of the light comes back, three quarters go through.
class leaf_listing()
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "reflection", LambertBrdf());
        AddLobe(boundary, "transmission", LambertBtdf());
    }
    public void mnk_prelighting(MnkMaterialBoundary boundary)
    {
        LambertBrdf reflection = LambertBrdf("diffuseReflectance", color(1.0, 0, 0));
        LambertBtdf transmission = LambertBtdf("diffuseTransmittance", color(0, 1.0, 0));
        SetLobe(boundary, "reflection", 0.25, reflection);
        SetLobe(boundary, "transmission", 0.75, transmission);
    }
}
