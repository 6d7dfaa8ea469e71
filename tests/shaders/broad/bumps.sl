// Bumps without displacement: steep enough to lean lobes below the surface.
displacement bumps(
    float slope = 3;  // of the steepest
    float scale = 5;  // bumps per unit of shader space
)
{
    normal n = normalize(N);
    N = normalize(calculatenormal(P + n * (slope / scale * (float noise(transform("shader", P) * scale) - 0.5))));
}
