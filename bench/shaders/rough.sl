// A rough surface: broad swells with grain as fine as a micropolygon, so that no part of it is flat.
displacement rough(
    float swell = 0.1;    // height of the swells, in object units
    float frequency = 4;  // of the swells, per unit of shader space
    float grain = 0.005;  // height of the grain, in object units
    float fineness = 200; // frequency of the grain
) {
    point Q = transform("shader", P);
    float height = swell * (float noise(frequency * Q) - 0.5) + grain * (float noise(fineness * Q) - 0.5);
    P += height * normalize(N);
    N = calculatenormal(P);
}
