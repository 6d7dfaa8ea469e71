// Bare metal by its reflectances: polished, cast or brushed.
class conductor(
    color reflectance = color(0.95, 0.93, 0.88); // at normal incidence; the default is silver
    color edgeReflectance = 1;                   // at grazing incidence
    float roughness = 0.2;                       // perceptual roughness; 0 is a mirror
    float unevenness = 0;                        // how much roughness varies over the surface, as a part of it
    float scale = 8;                             // patches of that unevenness per unit of shader space
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "metal", MicrofacetConductorBrdf());
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        float worn = roughness;
        if (unevenness > 0) {
            point Q = transform("shader", P) * scale;
            worn = clamp(roughness * (1 + unevenness * (2 * float noise(Q) - 1) + 0.5 * unevenness * (2 * float noise(3.1 * Q) - 1)),
                         0, 1);
        }
        MicrofacetConductorBrdf metal = MicrofacetConductorBrdf(
            "reflectance", reflectance, "edgeReflectance", edgeReflectance, "roughness", worn);
        SetLobe(boundary, "metal", 1.0, metal);
    }
}
