// MetalBrdf: a metal by its symbol, under a film. Expect metal 3, the film 800 u nm thick.
class lobe_metal()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", MetalBrdf("metal", "Au", "roughness", 0.3));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, MetalBrdf("metal", "Au", "filmThickness", 800 * u, "filmIor", 1.8));
    }
}
