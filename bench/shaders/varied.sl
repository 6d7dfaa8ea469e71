// A body under an interface, all of whose inputs vary from place to place: what a painted, worn thing has.
class varied(float grain = 0.01; float fineness = 300;)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "coat", MicrofacetDielectricBrdf());
        AddLobe(boundary, "body", LambertBrdf());
        AddLayer(boundary, "all", "coat", "coat", "body");
    }

    public void mnk_displacement(output point P; output normal N)
    {
        P += normalize(N) * (grain * (float noise(transform("shader", P) * fineness) - 0.5));
        N = calculatenormal(P);
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point at = transform("shader", P) * 5;
        float worn = float noise(at);
        SetLobe(boundary, "coat", worn, MicrofacetDielectricBrdf("roughness", 0.1 + 0.5 * float noise(at * 3)));
        SetLobe(boundary, "body", 1, LambertBrdf("diffuseReflectance", color noise(at * 2)));
        SetLayer(boundary, "all", 1);
    }
}
