// Metal that mirrors: an environment picture where one is named, the scene itself otherwise.
surface shinymetal(
    float Ka = 1;            // ambient reflection, as a part of Cs
    float Ks = 1;            // specular reflection, as a part of Cs
    float Kr = 1;            // mirror reflection, as a part of Cs; of what the highlight leaves
    float roughness = 0.1;   // width of the highlight
    string texturename = ""; // environment picture to mirror; "" = trace the scene
) {
    normal Nf = faceforward(normalize(N), I);
    vector V = -normalize(I);
    vector R = reflect(normalize(I), Nf);
    color mirrored;
    if (texturename != "")
        mirrored = color environment(texturename, vtransform("world", R));
    else
        mirrored = trace(P, R);
    // A highlight of exponent n = 8 / roughness reflects 8 / (n + 2) of all light.
    float highlight = Ks * 4 * roughness / (4 + roughness);
    Oi = Os;
    Ci = Oi * Cs * (Ka * ambient() + Ks * specular(Nf, V, roughness) + min(Kr, max(0, 1 - highlight)) * mirrored);
}
