// PhongBrdf: exponents. Expect exponents from 10 to 50 along u.
class lobe_phong()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", PhongBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, PhongBrdf("reflectance", color(0.5), "exponent", 10 + 40 * u));
    }
}
