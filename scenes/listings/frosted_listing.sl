// A rough dielectric with an inside.
class frosted_listing(
    float ior = 1.5;        // index of refraction
    float roughness = 0.2;  // perceptual roughness of the surface
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "bsdf", MicrosurfaceDielectricBsdfRgb_v1());
        MnkMaterialInterior interior =
        CreateInterior(material, "homogeneous", ior);
        AddPhaseFunction(interior, "pf", HenyeyGreensteinPfrgb());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        MicrosurfaceDielectricBsdfRgb_v1 params = MicrosurfaceDielectricBsdfRgb_v1("roughness", color(roughness));
        SetLobe(boundary, "bsdf", 1.0, params);
    }
    public void mnk_interior(output MnkMaterialInterior interior)
    {
        HenyeyGreensteinPfrgb pf = HenyeyGreensteinPfrgb("meanCosine", color(0));
        SetAbsorption(interior, color(0));
    }
}
