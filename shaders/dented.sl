// Dents a surface by sums of noise: small ones in large ones.
displacement dented(
    float Km = 1;        // depth
    float frequency = 1; // dents per unit of shader space
)
{
    point Q = transform("shader", P) * frequency;
    float sum = 0, size = 1, i;
    for (i = 0; i < 6; i += 1) {
        sum += abs(0.5 - float noise(4 * size * Q)) / size;
        size *= 2;
    }
    P -= normalize(N) * (Km * 0.06 * pow(sum, 3));
    N = calculatenormal(P);
}
