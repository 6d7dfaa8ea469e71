// Plastic whose body colour is painted with a texture.
surface paintedplastic(
    float Ka = 1;            // ambient reflection, as a part of the body colour
    float Kd = 0.5;          // diffuse reflection, as a part of the body colour
    float Ks = 0.5;          // specular reflection, as a part of specularcolor
    float roughness = 0.1;   // width of the highlight
    color specularcolor = 1; // colour of the highlight
    string texturename = ""; // picture that multiplies Cs over (s, t); "" = none
) {
    normal Nf = faceforward(normalize(N), I);
    vector V = -normalize(I);
    color paint = 1;
    if (texturename != "")
        paint = color texture(texturename);
    color body = Cs * paint * (Ka * ambient() + Kd * diffuse(Nf));
    color gloss = specularcolor * Ks * specular(Nf, V, roughness);
    Oi = Os;
    Ci = Oi * (body + gloss);
}
