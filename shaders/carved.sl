// A ball of stone carved with lozenges along two families of loxodromes, so that they stay square up to the poles.
// For shapes round the origin of object space with their axis along z.
class carved(
    float count = 12;                          // lozenges around the equator
    float depth = 0.05;                        // of the grooves, in units of current space
    float grain = 0.004;                       // height of the stone's own roughness
    float grainScale = 22;                     // of that roughness, per unit of object space
    color stone = color(0.60, 0.50, 0.38);     // reflectance of the lozenges
    color veins = color(0.42, 0.29, 0.19);     // reflectance of the veins in them
    color dust = color(0.17, 0.13, 0.10);      // reflectance of what fills the grooves
)
{
    // 0 in the grooves, 1 on the cushions. Depends on the direction from the centre alone, which carving leaves as it is.
    float cushions(vector D)
    {
        float z = clamp(zcomp(D), -0.985, 0.985);
        float mercator = 0.5 * log((1 + z) / (1 - z));
        float around = atan(ycomp(D), xcomp(D));
        float a = abs(sin(0.5 * count * (around + mercator)));
        float b = abs(sin(0.5 * count * (around - mercator)));
        return sqrt(a * b);
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "stone", LambertBrdf());
    }

    public void mnk_displacement(output point P; output normal N)
    {
        point Q = transform("object", P);
        vector D = normalize(vector(Q));
        float polar = sqrt(max(0, 1 - zcomp(D) * zcomp(D)));
        float rough = float noise(grainScale * Q) + 0.5 * float noise(2.1 * grainScale * Q) - 0.75;
        float height = depth * smoothstep(0.05, 0.5, polar) * (cushions(D) - 1) + grain * rough;
        P += normalize(N) * height;
        N = normalize(calculatenormal(P));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P);
        vector D = normalize(vector(Q));
        float high = cushions(D);
        // Sediment: layers across z, bent by noise.
        float bend = 0.35 * float noise(2.3 * Q);
        float layers = float noise(14 * (zcomp(Q) + bend)) * 0.7 + 0.3 * float noise(9 * Q);
        color body = mix(stone, veins, smoothstep(0.45, 0.75, layers));
        body *= 0.85 + 0.3 * float noise(31 * Q);
        color all = mix(dust, body, smoothstep(0.1, 0.45, high));
        SetLobe(boundary, "stone", 1.0, LambertBrdf("diffuseReflectance", all));
    }
}
