// ThinWalledDielectricBsdf: a soap film that drains. Expect thickness 100 to 900, by v.
class lobe_thin_wall()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", ThinWalledDielectricBsdf("ior", 1.33));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, ThinWalledDielectricBsdf("thickness", mix(900, 100, v)));
    }
}
