// Polished slabs with sunken joints. Each slab shows another part of a repeating picture, so no two are alike.
class tiles(
    string texturename = "";               // picture of the slabs; "" = plain
    color tint = 1;                        // multiplies the picture
    color jointColor = color(0.10, 0.09, 0.08); // reflectance of the joints
    float size = 1;                        // of a slab, in units of shader space; slabs lie in its x-y plane
    float picture = 0.6;                   // part of the picture's side that a slab shows
    float joint = 0.008;                   // width of the joints, in the same units
    float depth = 0.004;                   // of the joints
    float tilt = 0.002;                    // slope by which slabs lie uneven
    float roughness = 0.28;                // perceptual roughness of the polish
    float wear = 0.5;                      // how much duller the polish is in places
    float ior = 1.5;                       // index of refraction of the polish
)
{
    // 1 on a slab, 0 in a joint, with an edge as soft as the joint is wide (or as the vertices are apart).
    float slab(float x, y, soft)
    {
        float dx = abs(mod(x, 1) - 0.5), dy = abs(mod(y, 1) - 0.5);
        float edge = 0.5 - max(dx, dy); // distance to the slab's border
        float half = 0.5 * joint / size;
        return smoothstep(half, half + soft, edge);
    }

    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "polish", MicrofacetDielectricBrdf());
        AddLobe(boundary, "stone", LambertBrdf());
        AddLayer(boundary, "polished", "coat", "polish", "stone");
    }

    public void mnk_displacement(output point P; output normal N)
    {
        point Q = transform("shader", P) / size;
        float x = xcomp(Q), y = ycomp(Q);
        normal Nn = normalize(N);
        float corner = floor(x) + 57 * floor(y);
        float lean = tilt * size * ((float cellnoise(corner, 0) - 0.5) * (mod(x, 1) - 0.5)
                                    + (float cellnoise(corner, 1) - 0.5) * (mod(y, 1) - 0.5));
        float height = depth * (slab(x, y, 0.5 * joint / size) - 1) + lean;
        N = normalize(calculatenormal(P + Nn * height));
    }

    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        point Q = transform("shader", P) / size;
        float x = xcomp(Q), y = ycomp(Q);
        float on = slab(x, y, 0.25 * joint / size);
        float corner = floor(x) + 57 * floor(y);
        color stone = tint;
        if (texturename != "") {
            float ss = picture * x + float cellnoise(corner, 2);
            float tt = picture * y + float cellnoise(corner, 3);
            stone *= color texture(texturename, ss, tt);
        }
        stone *= 0.9 + 0.2 * float cellnoise(corner, 4);
        float dull = wear * smoothstep(0.35, 0.75, float noise(1.7 * Q) * 0.6 + float noise(6.3 * Q) * 0.4);
        SetLobe(boundary, "polish", 1.0,
                MicrofacetDielectricBrdf("ior", ior, "roughness", clamp(roughness * (1 + dull) + 0.5 * (1 - on), 0, 1)));
        SetLobe(boundary, "stone", 1.0, LambertBrdf("diffuseReflectance", mix(jointColor, stone, on)));
        SetLayer(boundary, "polished", on);
    }
}
