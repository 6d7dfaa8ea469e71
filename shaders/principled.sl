// The surface that shading networks of other renderers are taken for: dielectric or metal, a coat, light of its own.
//
//     emission + coat over (metallic * metal + (1 - metallic) * (gloss over the body))
class principled(
    color baseColor = 0.5;     // reflectance of the body, or of the metal
    string texturename = "";   // picture that multiplies baseColor over (s, t); "" = none
    float metallic = 0;        // 1 is metal
    float roughness = 0.3;     // perceptual roughness of gloss and metal
    float specular = 1;        // weight of the gloss; 0 is dull
    float ior = 1.5;           // index of refraction of the gloss
    float coat = 0;            // weight of a clear coat over everything
    float coatRoughness = 0.1; // perceptual roughness of the coat
    color emission = 0;        // radiance that the surface sends out alike in all directions
    float presence = 1;        // 0 is a hole
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "coat", MicrofacetDielectricBrdf("ior", 1.5));
        AddLobe(boundary, "metal", MicrofacetConductorBrdf());
        AddLobe(boundary, "gloss", MicrofacetDielectricBrdf());
        AddLobe(boundary, "body", LambertBrdf());
        AddLobe(boundary, "light", DiffuseEmission());
        AddLayer(boundary, "dielectric", "coat", "gloss", "body");
        AddLayer(boundary, "base", "mix", "metal", "dielectric");
        AddLayer(boundary, "coated", "coat", "coat", "base");
        AddLayer(boundary, "all", "add", "light", "coated");
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        color base = baseColor;
        if (texturename != "")
            base *= color texture(texturename);
        MicrofacetDielectricBrdf clear = MicrofacetDielectricBrdf("ior", 1.5, "roughness", coatRoughness);
        MicrofacetConductorBrdf metal = MicrofacetConductorBrdf("reflectance", base, "roughness", roughness);
        MicrofacetDielectricBrdf gloss = MicrofacetDielectricBrdf("ior", ior, "roughness", roughness);
        LambertBrdf body = LambertBrdf("diffuseReflectance", base);
        DiffuseEmission glow = DiffuseEmission("radiance", emission);
        SetLobe(boundary, "coat", 1.0, clear);
        SetLobe(boundary, "metal", 1.0, metal);
        SetLobe(boundary, "gloss", 1.0, gloss);
        SetLobe(boundary, "body", 1.0, body);
        SetLobe(boundary, "light", 1.0, glow);
        SetLayer(boundary, "dielectric", specular);
        SetLayer(boundary, "base", metallic);
        SetLayer(boundary, "coated", coat);
        SetLayer(boundary, "all", 1.0);
        SetPresence(boundary, presence);
    }
}
