// MetalBrdf: a metal by index and extinction. Expect eta and extinction as given, eta without upper bound of one.
class lobe_metal_index()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", MetalBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, MetalBrdf("eta", color(0.2, 1 + u, 1.3), "extinction", color(3.9, 2.4, 2)));
    }
}
