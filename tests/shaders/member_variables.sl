// Member variables of a class, set by init, read by prelighting. Expect r = (3, 4, 5).
class member_variables()
{
    float number = 3;
    color tint = color(0, 4, 0);
    string word = "five";

    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "plus", DiffuseEmission());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        float five = word == "five" ? 5 : 0;
        SetLobe(boundary, "plus", 1, DiffuseEmission("radiance", color(number, comp(tint, 1), five)));
    }
}
