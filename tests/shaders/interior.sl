// mnk_interior sets what is inside, once.
// Expect index of refraction 1.4, absorption (0, 1, 2), scattering 3, mean cosine 0.6.
class interior(float ior = 1.4;)
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "bsdf", MicrosurfaceDielectricBsdfRgb_v1());
        MnkMaterialInterior inside = CreateInterior(material, "homogeneous", ior);
        AddPhaseFunction(inside, "pf", HenyeyGreensteinPfrgb());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SetLobe(boundary, "bsdf", 1, MicrosurfaceDielectricBsdfRgb_v1("roughness", color(0.1 * u)));
    }
    public void mnk_interior(output MnkMaterialInterior inside)
    {
        SetAbsorption(inside, color(0, 1, 2));
        SetScattering(inside, color(3));
        SetPhaseFunction(inside, "pf", HenyeyGreensteinPfrgb("meanCosine", color(0.6)));
    }
}
