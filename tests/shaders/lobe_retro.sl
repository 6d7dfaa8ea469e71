// RetroBrdf: back to the light. Expect roughness 0.2 + 0.3 v.
class lobe_retro()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", RetroBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, RetroBrdf("reflectance", color(0.9, 0.6, 0.1), "roughness", 0.2 + 0.3 * v));
    }
}
