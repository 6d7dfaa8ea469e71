// Lacquer: a clear coat over paint, or over metal that shows through it.
//
//     coat (dielectric reflection)      light is bent below it, and goes to and fro
//       |
//     base: metallic * metal + (1 - metallic) * paint
class lacquer(
    color paint = color(0.55, 0.02, 0.02); // reflectance of the paint without the coat
    float metallic = 0;                    // part of the base that is metal flakes of the same colour
    float flakeRoughness = 0.45;           // perceptual roughness of those flakes
    float coatWeight = 1;                  // 0 = no coat
    float coatIor = 1.5;                   // index of refraction of the coat
    float coatRoughness = 0.08;            // perceptual roughness of the coat
    float orangePeel = 0;                  // slope of the coat's waviness
    float peelScale = 30;                  // waves per unit of shader space
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "coat", MicrofacetDielectricBrdf());
        AddLobe(boundary, "flakes", MicrofacetConductorBrdf());
        AddLobe(boundary, "paint", LambertBrdf());
        AddLayer(boundary, "base", "mix", "flakes", "paint");
        AddLayer(boundary, "lacquer", "thick", "coat", "base");
    }

    public void mnk_displacement(output point P; output normal N)
    {
        if (orangePeel > 0) {
            normal Nn = normalize(N);
            float wave = float noise(transform("shader", P) * peelScale) - 0.5;
            N = normalize(calculatenormal(P + Nn * (orangePeel / peelScale * wave)));
        }
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        MicrofacetDielectricBrdf coat = MicrofacetDielectricBrdf("ior", coatIor, "roughness", coatRoughness);
        MicrofacetConductorBrdf flakes = MicrofacetConductorBrdf("reflectance", paint, "roughness", flakeRoughness);
        LambertBrdf body = LambertBrdf("diffuseReflectance", paint);
        SetLobe(boundary, "coat", 1.0, coat);
        SetLobe(boundary, "flakes", 1.0, flakes);
        SetLobe(boundary, "paint", 1.0, body);
        SetLayer(boundary, "base", metallic);
        SetLayer(boundary, "lacquer", coatWeight);
    }
}
