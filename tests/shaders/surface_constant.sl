// Ci without light is emission. Expect (1, u, 0).
surface surface_constant()
{
    Oi = 1;
    Ci = color(1, u, 0);
}
