// SheenBrdf: a weight that varies. Expect weight v, the reflectance once.
class lobe_sheen()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", SheenBrdf("roughness", 0.4));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", v, SheenBrdf("reflectance", color(0.9, 0.2, 0.3)));
    }
}
