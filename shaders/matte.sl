// A dull surface: Lambert's law alone.
surface matte(
    float Ka = 1; // ambient reflection, as a part of Cs
    float Kd = 1; // diffuse reflection, as a part of Cs
) {
    normal Nf = faceforward(normalize(N), I);
    color lit = Ka * ambient() + Kd * diffuse(Nf);
    Oi = Os;
    Ci = Oi * Cs * lit;
}
