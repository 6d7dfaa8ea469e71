// Oi becomes presence. Expect u.
surface surface_opacity()
{
    Oi = u;
    Ci = Oi * diffuse(N);
}
