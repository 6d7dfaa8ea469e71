// Lava rock, or coral by other colours: patches, pits, moss where it looks up, dark and wet at the water's edge.
class stone(
    color dark = color(0.055, 0.05, 0.048); // reflectance
    color pale = color(0.24, 0.21, 0.18);   // of patches
    float scale = 1.6;                      // patches a unit of object space
    float moss = 0.5;                       // how much of it
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "stone", OrenNayarBrdf("roughness", 0.7));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P) * scale;
        float patches = float noise(Q) * 0.55 + float noise(3.1 * Q) * 0.3 + float noise(9.7 * Q) * 0.15;
        color c = mix(dark, pale, smoothstep(0.3, 0.72, patches));
        c *= 0.7 + 0.5 * float noise(31 * Q);
        float up = ycomp(normalize(ntransform("object", N)));
        float grown = moss * smoothstep(0.35, 0.8, up) * smoothstep(0.4, 0.6, float noise(1.7 * Q + vector(7, 3, 1)));
        c = mix(c, color(0.09, 0.12, 0.03), grown);
        SetLobe(boundary, "stone", 1, OrenNayarBrdf("diffuseReflectance", c, "roughness", 0.7));
    }
}
