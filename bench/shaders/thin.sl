// A sheet of clear glass.
class thin(float ior = 1.5;)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "sheet", ThinWalledDielectricBsdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SetLobe(boundary, "sheet", 1, ThinWalledDielectricBsdf("ior", ior));
    }
}
