// The surface of deep water seen from above: waves by bump mapping, calmer where they are too fine to see.
class water(
    color deep = color(0.006, 0.022, 0.03); // reflectance of what the depth sends back
    float wavelength = 3;                   // of the longest waves, in units of shader space
    float height = 0.12;                    // of those waves
    float octaves = 5;                      // levels of ever shorter waves
    float roughness = 0.08;                 // perceptual roughness of the water between the waves
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "surface", MicrofacetDielectricBrdf());
        AddLobe(boundary, "deep", LambertBrdf());
        AddLayer(boundary, "water", "coat", "surface", "deep");
    }

    // Waves that the vertices are too sparse to carry are left out here, and make the surface rougher below.
    float waves(point Q; float width)
    {
        float sum = 0, size = 1, i;
        for (i = 0; i < octaves; i += 1) {
            float seen = 1 - smoothstep(0.15, 0.4, width * size);
            sum += seen * (float noise(Q * size + vector(0, 0, 7 * i)) - 0.5) / size;
            size *= 2.13;
        }
        return sum;
    }

    public void mnk_displacement(output point P; output normal N)
    {
        point Q = transform("shader", P) / wavelength;
        float width = max(filterwidth(xcomp(Q)), filterwidth(ycomp(Q)));
        normal Nn = normalize(N);
        N = normalize(calculatenormal(P + Nn * (height * waves(Q, width))));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("shader", P) / wavelength;
        float width = max(filterwidth(xcomp(Q)), filterwidth(ycomp(Q)));
        float unseen = smoothstep(0, 1, width);
        float slope = height / wavelength;
        float rough = clamp(sqrt(roughness * roughness + 2 * unseen * slope), 0, 1);
        SetLobe(boundary, "surface", 1.0, MicrofacetDielectricBrdf("ior", 1.33, "roughness", rough));
        SetLobe(boundary, "deep", 1.0, LambertBrdf("diffuseReflectance", deep));
    }
}
