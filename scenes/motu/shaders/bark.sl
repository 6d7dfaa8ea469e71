// Bark: furrows that follow the noise of the trunk, or the rings of a palm. Dark in the depths.
class bark(
    color dark = color(0.09, 0.07, 0.055); // reflectance in the furrows
    color pale = color(0.3, 0.26, 0.21);   // and of what stands out
    float rings = 0;                       // a metre of height; 0 = furrows
    float height = 0.018;                  // of the relief, in metres
)
{
    varying float relief = 0;

    float raised(point Q)
    {
        float up = ycomp(Q);
        float furrows = abs(2 * float noise(Q * vector(16, 3, 16)) - 1);
        float scars = smoothstep(0, 0.35, mod(up * rings + 0.5 * float noise(3 * Q), 1));
        return rings > 0 ? 0.8 * scars + 0.2 * furrows : furrows;
    }

    public void mnk_displacement(output point P; output normal N)
    {
        relief = raised(transform("object", P));
        normal before = normalize(calculatenormal(P));
        normal given = normalize(N);
        P += given * (height * relief);
        N = normalize(given + normalize(calculatenormal(P)) - before);
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "bark", OrenNayarBrdf("roughness", 0.6));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P);
        float lichen = smoothstep(0.55, 0.8, float noise(2.3 * Q) * 0.7 + float noise(11 * Q) * 0.3);
        color c = mix(dark, pale, 0.25 + 0.75 * relief);
        c = mix(c, color(0.3, 0.33, 0.25), 0.5 * lichen);
        SetLobe(boundary, "bark", 1, OrenNayarBrdf("diffuseReflectance", c, "roughness", 0.6));
    }
}
