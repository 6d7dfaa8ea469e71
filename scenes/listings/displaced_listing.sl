// Displacement for shape, bump for what is finer than the micropolygons.
class displaced_listing(
    float height = 0.25;     // of the displacement, in units of current space
    float bumpheight = 0.02; // of the bump
)
{
    float mydisplacement()
    {
        point Q = transform("shader", P);
        return 0.5 + 0.5 * sin(9 * xcomp(Q)) * sin(9 * ycomp(Q)) * sin(9 * zcomp(Q));
    }
    float mybump()
    {
        return float noise(40 * transform("shader", P));
    }
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "reflection", LambertBrdf("diffuseReflectance", color(0.65, 0.6, 0.5)));
    }
    public void mnk_displacement(output point P; output normal N)
    {
        P += normalize(N) * height * mydisplacement();
        N = normalize(calculatenormal(P));
        point Pbump = P + N * bumpheight * mybump();
        N = normalize(calculatenormal(Pbump));
    }
}
