// The island's ground, by height and slope: the sea's floor, wet and dry sand, soil, rock. Object space is the island's,
// in metres, with y up and the sea at 0. What is flat moves by 4 cm at most, so that what stands there stands.
class ground(
    varying float dune = 0;                  // 1 is sand however high it is
    color sand = color(0.6, 0.49, 0.34);     // reflectance, dry
    color wet = color(0.3, 0.235, 0.155);    // where waves reach
    color below = color(0.55, 0.51, 0.4);    // the lagoon's floor
    color deep = color(0.01, 0.035, 0.06);   // what the open sea sends back from below
    color soil = color(0.13, 0.105, 0.065);  // under trees
    color green = color(0.085, 0.125, 0.03); // what covers soil
    color rock = color(0.12, 0.105, 0.09);   // where it is steep
)
{
    varying float steepness = 0;

    // Ripples of sand, clods of soil, ledges of rock; octaves too fine for the vertices are left out.
    float rise(point Q; float high, steep, width)
    {
        float seen = 1 - smoothstep(0.06, 0.2, width);
        float sandy = max(dune, 1 - smoothstep(2.6, 4, high));
        point R = Q + 0.6 * (vector noise(0.35 * Q) - vector(0.5, 0.5, 0.5));
        float ripples = 0.012 * sin(11 * (0.8 * xcomp(R) + zcomp(R)) + 3 * float noise(0.8 * Q)) * seen;
        float humps = 0.03 * (float noise(1.3 * Q) - 0.5) * (1 - smoothstep(0.3, 1, width));
        float clods = 0.03 * (float noise(5 * Q) - 0.5) * seen * (1 - sandy);
        float ledges = abs(2 * float noise(0.16 * Q * vector(1, 2.2, 1)) - 1) + 0.5 * abs(2 * float noise(0.5 * Q) - 1);
        float cliffs = 1.6 * (ledges - 0.7) * smoothstep(0.95, 1.4, steep);
        return sandy * (1 - smoothstep(0.5, 1.2, steep)) * ripples + humps + clods + cliffs;
    }

    public void mnk_displacement(output point P; output normal N)
    {
        point Q = transform("object", P);
        normal given = normalize(N);
        float up = abs(ycomp(normalize(ntransform("object", N))));
        steepness = sqrt(1 - up * up) / max(up, 0.01);
        float width = max(filterwidth(xcomp(Q)), filterwidth(zcomp(Q)));
        normal before = normalize(calculatenormal(P));
        P += given * rise(Q, ycomp(Q), steepness, width);
        N = normalize(given + normalize(calculatenormal(P)) - before);
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "film", MicrofacetDielectricBrdf("ior", 1.33));
        AddLobe(boundary, "ground", OrenNayarBrdf("roughness", 0.5));
        AddLayer(boundary, "all", "coat", "film", "ground");
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P);
        float high = ycomp(Q);
        float large = float noise(0.03 * Q), middle = float noise(0.21 * Q), fine = float noise(2.7 * Q);
        float wander = 0.5 * (middle - 0.5) + 0.25 * (fine - 0.5);
        float dry = smoothstep(0.32, 0.7, high + 0.5 * wander);
        color c = mix(wet, sand * (0.82 + 0.36 * fine), dry);
        float under = smoothstep(0.05, -0.6, high);
        float weeds = smoothstep(0.52, 0.68, 0.6 * large + 0.4 * middle);
        color floor_ = mix(below, color(0.12, 0.13, 0.08), 0.75 * weeds * smoothstep(-0.8, -1.8, high));
        floor_ = mix(floor_, deep, smoothstep(-4, -14, high));
        c = mix(c, floor_, under);
        float grown = smoothstep(2.0, 3.3, high + 2.2 * wander) * (1 - 0.93 * smoothstep(0.2, 0.7, dune + wander));
        color cover = mix(green * (0.55 + 0.9 * middle), soil, smoothstep(0.5, 0.75, fine));
        c = mix(c, cover * (0.75 + 0.5 * large), grown);
        c = mix(c, rock * (0.55 + 0.9 * float noise(0.9 * Q)), smoothstep(1.0, 1.5, steepness + 0.5 * wander));
        float wetness = (1 - dry) * (1 - under);
        SetLobe(boundary, "film", wetness, MicrofacetDielectricBrdf("ior", 1.33, "roughness", 0.25));
        SetLobe(boundary, "ground", 1, OrenNayarBrdf("diffuseReflectance", c, "roughness", 0.5));
    }
}
