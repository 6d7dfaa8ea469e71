// OrenNayarBrdf: a constant of mnk_init stays, the roughness varies. Expect the reflectance once, roughness u.
class lobe_oren_nayar()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", OrenNayarBrdf("diffuseReflectance", color(0.8, 0.4, 0.2)));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, OrenNayarBrdf("roughness", u));
    }
}
