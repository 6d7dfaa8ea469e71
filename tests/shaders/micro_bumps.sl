// Fine bumps of two sizes.
displacement micro_bumps(
    float Kd = 0.1; // height
    float mult = 5; // bumps per unit of shader space
)
{
    point Q = transform("shader", P) * mult;
    float height = float noise(Q) + 0.3 * float noise(4 * Q);
    P += normalize(N) * (Kd * (height - 0.65));
    N = calculatenormal(P);
}
