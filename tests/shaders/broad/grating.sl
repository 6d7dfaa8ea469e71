// A grating as blurred as one can be.
class grating()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "l", GratingBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "l", 1, GratingBrdf("period", 1600, "roughness", 1, "rotation", u));
    }
}
