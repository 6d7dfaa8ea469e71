// Gold by its measured index of refraction.
class metal_Au(float roughness = 0;)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "metal", MetalBrdf("metal", "Au"));
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        SetLobe(boundary, "metal", 1, MetalBrdf("metal", "Au", "roughness", roughness));
    }
}
