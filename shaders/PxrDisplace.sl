// Displace of RIS: a model's own displacement, then one along the normal and one by a vector. Lengths and vectors are
// those of object space.
displacement PxrDisplace(
    float enabled = 1;                         // 0: nothing moves
    float dispAmount = 1;                      // of what follows the model's own
    varying float dispScalar = 0;              // along the normal
    varying vector dispVector = vector(0, 0, 0);      // by a vector
    varying vector modelDispVector = vector(0, 0, 0); // the model's own, first
)
{
    if (enabled != 0) {
        P += vtransform("object", "current", modelDispVector);
        normal moved = calculatenormal(P);
        if (modelDispVector . modelDispVector > 0)
            N = moved; // else the normal stays as smooth as it was
        normal n = normalize(ntransform("object", N));
        P += dispAmount * vtransform("object", "current", dispScalar * vector(n) + dispVector);
        N = calculatenormal(P);
    }
}
