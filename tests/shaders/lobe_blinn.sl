// BlinnBrdf: an exponent below its range. Expect exponents clamped at 0.
class lobe_blinn()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", BlinnBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, BlinnBrdf("exponent", 40 * u - 20));
    }
}
