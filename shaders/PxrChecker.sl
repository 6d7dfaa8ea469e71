// Pattern of RIS: squares of two colours over (s, t), frequency to a unit.
surface PxrChecker(
    color colorA = color(1, 0, 0);         // of the square at the origin, and every second one
    color colorB = color(0, 0, 1);         // of the others
    float frequency = 1;                   // squares along s and t to a unit
    output varying color resultRGB = 0;    // the colour
    output varying float resultF = 0;      // its mean
)
{
    float odd = mod(floor(s * frequency) + floor(t * frequency), 2);
    resultRGB = mix(colorA, colorB, odd);
    resultF = (comp(resultRGB, 0) + comp(resultRGB, 1) + comp(resultRGB, 2)) / 3;
}
