// BurleyBrdf: roughness beyond its range is clamped. Expect roughness 2 v, at most 1.
class lobe_burley()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", BurleyBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, BurleyBrdf("diffuseReflectance", color(u, 0.5, 0.5), "roughness", 2 * v));
    }
}
