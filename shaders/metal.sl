// Bare metal: a coloured highlight and nothing below it.
surface metal(
    float Ka = 1;          // ambient reflection, as a part of Cs
    float Ks = 1;          // specular reflection, as a part of Cs
    float roughness = 0.1; // width of the highlight
) {
    normal Nf = faceforward(normalize(N), I);
    vector V = -normalize(I);
    color lit = Ka * ambient() + Ks * specular(Nf, V, roughness);
    Oi = Os;
    Ci = Oi * Cs * lit;
}
