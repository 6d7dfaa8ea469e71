// The sea: a clear surface with waves pushed out of it, and water below. `depth` says how deep it is: the lagoon is
// calm, the open sea is not, and where it ends on the beach there is foam. Object space is the island's, in metres.
class sea(
    varying float depth = 20;                   // of the water, metres
    varying float surf = 0;                     // how much the waves break
    float swell = 0.4;                          // height of the open sea's waves
    float calm = 0.022;                         // and of the lagoon's
    float roughness = 0.06;                     // between the waves; above 0 for sunlight to be found below
    color absorption = color(0.26, 0.045, 0.024); // a metre
)
{
    varying float wave = 0;
    varying float lost = 0; // mean square slope of the waves that are too fine for the vertices

    // Trains of waves that go with the wind, their crests narrower than their troughs; then noise. Octave by octave.
    float waves(point Q; float width; output float left)
    {
        float sum = 0, size = 1, turn = 0.4, i;
        float x = xcomp(Q), z = zcomp(Q);
        left = 0;
        for (i = 0; i < 9; i += 1) {
            float length_ = 9.0 / size;
            float seen = 1 - smoothstep(0.2, 0.5, width / length_);
            float phase = 6.2832 * (x * cos(turn) + z * sin(turn)) / length_ + 5 * float noise(Q * (0.35 / length_) + vector(3.1 * i, 0, 0));
            float crest = 0.5 + 0.5 * sin(phase);
            float patch = 0.35 + 1.3 * float noise(Q * (0.14 / length_) + vector(0, 0, 5.7 * i));
            sum += seen * patch * (crest * crest - 0.375) * pow(size, -1.22);
            left += (1 - seen) * (1 - seen) * 0.25 * pow(size, -0.44);
            turn += 2.1;
            size *= 1.62;
        }
        return sum;
    }

    public void mnk_displacement(output point P; output normal N)
    {
        point Q = transform("object", P);
        normal given = normalize(N);
        float width = max(filterwidth(xcomp(Q)), filterwidth(zcomp(Q)));
        float high = mix(calm, swell, smoothstep(3.2, 12, depth)) * (1 + 9 * surf) * smoothstep(-0.2, 1.2, depth);
        wave = waves(Q, width, lost);
        lost *= high * high * 0.09;
        P += given * (high * wave);
        N = normalize(calculatenormal(P));
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "water", MicrosurfaceDielectricBsdfRgb_v1());
        AddLobe(boundary, "foam", LambertBrdf());
        AddLayer(boundary, "surface", "mix", "foam", "water");
        MnkMaterialInterior interior = CreateInterior(material, "homogeneous", 1.33);
    }

    public void mnk_interior(output MnkMaterialInterior interior)
    {
        SetAbsorption(interior, absorption);
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P);
        float lace = abs(2 * float noise(1.9 * Q + 0.4 * vector noise(4 * Q)) - 1);
        lace = 1 - smoothstep(0.05, 0.3, lace + 0.35 * abs(2 * float noise(6.3 * Q) - 1));
        float edge = depth + 0.12 * (float noise(0.11 * Q) - 0.5);
        float band = smoothstep(0.0, 0.03, edge) * (1 - smoothstep(0.04, 0.2, edge));
        float second = smoothstep(0.28, 0.36, edge) * (1 - smoothstep(0.36, 0.5, edge)) * smoothstep(0.5, 0.62, float noise(0.05 * Q));
        float breakers = surf * smoothstep(0.42, 0.62, float noise(0.09 * Q) * 0.6 + float noise(0.5 * Q) * 0.4);
        float foam = clamp(band * (0.35 + 0.65 * lace) + 0.7 * second * lace + breakers * (0.3 + 0.7 * lace), 0, 1);
        float rough = clamp(sqrt(sqrt(roughness * roughness * roughness * roughness + 2 * lost)), 0, 0.5);
        SetLobe(boundary, "water", 1, MicrosurfaceDielectricBsdfRgb_v1("ior", 1.33, "roughness", color(rough)));
        SetLobe(boundary, "foam", 1, LambertBrdf("diffuseReflectance", color(0.82)));
        SetLayer(boundary, "surface", 0.85 * foam);
    }
}
