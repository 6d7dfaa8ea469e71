// The floor of a wood, and meadow where it is open: earth, moss, last year's leaves.
class floor(
    color earth = color(0.1, 0.07, 0.045); // reflectance of what is bare
    color moss = color(0.07, 0.11, 0.025); // and of what grows on it
    color litter = color(0.2, 0.13, 0.06); // of fallen leaves
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "ground", OrenNayarBrdf("roughness", 0.6));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("object", P);
        float large = float noise(0.02 * Q), middle = float noise(0.23 * Q), fine = float noise(3 * Q);
        color c = mix(earth, litter, smoothstep(0.35, 0.65, fine));
        c = mix(c, moss * (0.7 + 0.6 * middle), smoothstep(0.35, 0.6, 0.5 * large + 0.5 * middle));
        SetLobe(boundary, "ground", 1, OrenNayarBrdf("diffuseReflectance", c, "roughness", 0.6));
    }
}
