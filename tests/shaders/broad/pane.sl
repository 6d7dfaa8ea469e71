// A smooth window pane of tinted glass, which light passes as it came.
class pane()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", ThinWalledDielectricBsdf("ior", 1.5, "roughness", 0));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, ThinWalledDielectricBsdf("transmittance", color(0.9, 0.7, 0.5)));
    }
}
