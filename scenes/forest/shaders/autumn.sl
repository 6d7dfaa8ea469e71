// A leaf as it turns: green, gold, orange, red, brown. Trees choose, or stand between two (`variants` of a shape).
class autumn(
    color front = color(0.12, 0.24, 0.04);   // reflectance while it is green
    color through = color(0.24, 0.40, 0.05); // and transmittance
    uniform float variant = 0;               // 0 to 4
    float transmission = 0.4;                // part of the diffuse light that goes to the other side
    float gleam = 0.4;                       // weight of the gloss
    float roughness = 0.45;                  // of the skin
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "skin", MicrofacetDielectricBrdf("ior", 1.42));
        AddLobe(boundary, "reflection", LambertBrdf());
        AddLobe(boundary, "transmission", LambertBtdf());
        AddLayer(boundary, "flesh", "mix", "transmission", "reflection");
        AddLayer(boundary, "leaf", "coat", "skin", "flesh");
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        uniform color shown[5] = {color(0), color(0.42, 0.30, 0.03), color(0.46, 0.19, 0.025), color(0.38, 0.07, 0.025), color(0.17, 0.09, 0.04)};
        uniform color passing[5] = {color(0), color(0.62, 0.47, 0.03), color(0.62, 0.25, 0.02), color(0.52, 0.06, 0.02), color(0.2, 0.09, 0.03)};
        color f = front, t = through;
        uniform float which = clamp(floor(variant), 0, 4);
        if (which > 0) {
            f = shown[which];
            t = passing[which];
        }
        SetLobe(boundary, "skin", gleam, MicrofacetDielectricBrdf("ior", 1.42, "roughness", roughness));
        SetLobe(boundary, "reflection", 1, LambertBrdf("diffuseReflectance", f));
        SetLobe(boundary, "transmission", 1, LambertBtdf("diffuseTransmittance", t));
        SetLayer(boundary, "flesh", transmission);
    }
}
