// A displacement shader of RISpec. Expect P.z = 0.2 at the middle of u, 0 at its ends.
displacement displacement_classic(float Km = 0.2;)
{
    P += Km * sin(PI * u) * normalize(N);
    N = calculatenormal(P);
}
