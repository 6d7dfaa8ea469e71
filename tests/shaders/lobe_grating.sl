// GratingBrdf: a disc. Expect period 1600, rotation u.
class lobe_grating()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", GratingBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, GratingBrdf("period", 1600, "rotation", u));
    }
}
