// Rough stone: bulges and grain pushed out of any shape, coloured in patches.
class rock(
    float scale = 2;                          // bulges per unit of shader space
    float height = 0.15;                      // of the bulges, in units of current space
    float grain = 0.15;                       // height of the finest detail, as a part of the bulges
    float octaves = 6;                        // levels of detail
    color pale = color(0.46, 0.42, 0.37);     // reflectance of the pale patches
    color dark = color(0.16, 0.14, 0.13);     // reflectance of the dark ones
)
{
    // Ridged noise (Musgrave's construction): creases where octaves change sign, in [0, 1].
    float bulges(point Q)
    {
        float sum = 0, amplitude = 0.5, i;
        point R = Q;
        for (i = 0; i < octaves; i += 1) {
            sum += amplitude * (1 - abs(2 * float noise(R) - 1));
            R = 2.07 * R + vector(13.7, 5.1, 9.3);
            amplitude *= 0.42 + 0.3 * grain;
        }
        return sum;
    }

    public void mnk_displacement(output point P; output normal N)
    {
        point Q = transform("shader", P) * scale;
        P += normalize(N) * (height * (bulges(Q) - 0.6));
        N = normalize(calculatenormal(P));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("shader", P) * scale;
        float patches = smoothstep(0.3, 0.7, float noise(0.8 * Q) * 0.6 + float noise(2.9 * Q) * 0.4);
        float specks = smoothstep(0.62, 0.75, float noise(24 * Q));
        color stone = mix(dark, pale, patches) * (1 - 0.35 * specks);
        SetLobe(boundary, "stone", 1.0, LambertBrdf("diffuseReflectance", stone));
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "stone", LambertBrdf());
    }
}
