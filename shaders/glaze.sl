// Glazed pottery: a glossy glaze that runs thin on ridges, thick in hollows and towards the foot, and leaves the foot bare.
// For shapes whose v runs from foot to mouth.
class glaze(
    color thin = color(0.64, 0.79, 0.74);  // reflectance below the gloss where the glaze is thin
    color thick = color(0.12, 0.40, 0.38); // likewise where it is thick
    color clay = color(0.34, 0.20, 0.13);  // reflectance of the bare foot
    float foot = 0.10;                     // v where the glaze ends
    float flutes = 26;                     // upright flutes around the body
    float depth = 0.014;                   // of the flutes, in units of current space
    float bottom = 0.22;                   // v between which they run
    float top = 0.50;                      // and up to which
    float roughness = 0.06;                // perceptual roughness of the glaze
    float crackle = 0.3;                   // how clearly fine cracks show
)
{
    // Height of the fluted body, 1 on the ridges.
    float fluted()
    {
        extern float u, v;
        float wave = abs(cos(PI * flutes * u));
        float span = smoothstep(bottom - 0.03, bottom + 0.03, v) * (1 - smoothstep(top - 0.03, top + 0.05, v));
        return 1 - span * wave;
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "gloss", MicrofacetDielectricBrdf());
        AddLobe(boundary, "body", LambertBrdf());
        AddLayer(boundary, "glazed", "thick", "gloss", "body");
    }

    public void mnk_displacement(output point P; output normal N)
    {
        P += normalize(N) * (depth * (fluted() - 1));
        N = normalize(calculatenormal(P));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P);
        float ragged = 0.02 * (float noise(9 * Q) - 0.5) + 0.008 * (float noise(31 * Q) - 0.5);
        float glazed = smoothstep(foot, foot + 0.006, v + ragged);
        float runs = float noise(point(5 * xcomp(Q), 1.2 * ycomp(Q), 5 * zcomp(Q)));
        float thickness = clamp(0.75 - 0.7 * fluted() + 0.45 * (1 - smoothstep(foot, 0.55, v)) + 0.6 * (runs - 0.5)
                                + 0.35 * smoothstep(0.55, 0.9, v), 0, 1);
        float cracks = 1 - smoothstep(0.0, 0.035, abs(float noise(17 * Q) - 0.5));
        color body = mix(thin, thick, thickness) * (1 - crackle * 0.5 * cracks);
        float shine = roughness + (1 - glazed) * 0.6;
        SetLobe(boundary, "gloss", 1.0, MicrofacetDielectricBrdf("ior", 1.5, "roughness", shine));
        SetLobe(boundary, "body", 1.0, LambertBrdf("diffuseReflectance", mix(clay * (0.8 + 0.4 * float noise(40 * Q)), body, glazed)));
        SetLayer(boundary, "glazed", mix(0.2, 1, glazed));
    }
}
