// Coloured body under a highlight of its own colour.
surface plastic(
    float Ka = 1;            // ambient reflection, as a part of Cs
    float Kd = 0.5;          // diffuse reflection, as a part of Cs
    float Ks = 0.5;          // specular reflection, as a part of specularcolor
    float roughness = 0.1;   // width of the highlight
    color specularcolor = 1; // colour of the highlight
) {
    normal Nf = faceforward(normalize(N), I);
    vector V = -normalize(I);
    color body = Cs * (Ka * ambient() + Kd * diffuse(Nf));
    color gloss = specularcolor * Ks * specular(Nf, V, roughness);
    Oi = Os;
    Ci = Oi * (body + gloss);
}
