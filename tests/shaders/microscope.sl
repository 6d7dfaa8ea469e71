// Dusty and dull, as under an electron microscope: the more a surface turns away, the brighter; no lights.
surface microscope(
    float Ka = 0.12; // brightness of what faces the eye, as a part of Cs
    float Kd = 0.9;  // and of the rims above it
)
{
    normal Nf = faceforward(normalize(N), I);
    float away = 1 - (-normalize(I)) . Nf;
    Oi = Os;
    Ci = Oi * Cs * (Ka + Kd * away * away);
}
