// Dusty and dull, as under an electron microscope.
surface microscope(
    float Ka = 0.3; // ambient reflection, as a part of Cs
    float Kd = 1;   // diffuse reflection, as a part of Cs
)
{
    normal Nf = faceforward(normalize(N), I);
    Oi = Os;
    Ci = Oi * Cs * (Ka * ambient() + Kd * diffuse(Nf));
}
