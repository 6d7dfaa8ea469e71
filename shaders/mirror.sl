// A perfect mirror.
class mirror(
    color reflectance = 0.95; // fraction of light reflected
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "mirror", MicrofacetConductorBrdf());
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        MicrofacetConductorBrdf mirror = MicrofacetConductorBrdf(
            "reflectance", reflectance, "edgeReflectance", reflectance, "roughness", 0);
        SetLobe(boundary, "mirror", 1.0, mirror);
    }
}
