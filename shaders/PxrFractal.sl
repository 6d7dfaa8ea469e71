// Pattern of RIS: a sum of noises in shader space, from 0 to 1.
surface PxrFractal(
    float layers = 6;                      // noises that are summed, 16 at most
    float frequency = 1;                   // of the first, cells to a unit
    float lacunarity = 2;                  // frequency of one by that of the one before
    float dimension = 1;                   // amplitude of one by that of the one before is lacunarity^-dimension
    color colorScale = 1;                  // of resultRGB
    output varying float resultF = 0;      // the sum
    output varying color resultRGB = 0;    // times colorScale
)
{
    point Q = transform("shader", P) * frequency;
    float sum = 0, all = 0, amplitude = 1;
    uniform float i;
    for (i = 0; i < min(layers, 16); i += 1) {
        sum += amplitude * noise(Q);
        all += amplitude;
        amplitude *= pow(lacunarity, -dimension);
        Q *= lacunarity;
    }
    if (all > 0)
        sum /= all;
    resultF = sum;
    resultRGB = sum * colorScale;
}
