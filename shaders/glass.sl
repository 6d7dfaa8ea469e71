// Clear, tinted or cloudy glass, and liquids: rough or smooth interface, dispersion, absorption, scattering.
class glass(
    float ior = 1.5;            // index of refraction, at 587.6 nm
    float abbe = 0;             // Abbe number; crown glass 59, dense flint 25, 0 = no dispersion
    float roughness = 0;        // perceptual roughness of the surface; 0 is polished
    color reflectance = 1;      // tint of what is reflected
    color transmittance = 1;    // tint of what passes the surface
    color absorption = 0;       // taken from light inside, per metre
    color scattering = 0;       // turned aside inside, per metre: milk, wax, skin
    float meanCosine = 0;       // of the angle by which it is turned: 1 forwards, 0 anywhere, -1 back
    float priority = 0;         // where bodies overlap, the highest is there: more for the glass than for what it holds
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "bsdf", MicrosurfaceDielectricBsdfRgb_v1());
        MnkMaterialInterior interior = CreateInterior(material, "homogeneous", ior);
        AddPhaseFunction(interior, "phase", HenyeyGreensteinPfrgb());
    }

    public void mnk_interior(output MnkMaterialInterior interior)
    {
        SetAbsorption(interior, absorption);
        SetScattering(interior, scattering);
        SetPhaseFunction(interior, "phase", HenyeyGreensteinPfrgb("meanCosine", color(meanCosine)));
        SetPriority(interior, priority);
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        MicrosurfaceDielectricBsdfRgb_v1 bsdf = MicrosurfaceDielectricBsdfRgb_v1(
            "roughness", color(roughness), "reflectance", reflectance, "transmittance", transmittance,
            "ior", ior, "abbe", abbe);
        SetLobe(boundary, "bsdf", 1.0, bsdf);
    }
}
