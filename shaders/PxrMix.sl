// Pattern of RIS: a mix of two colours.
surface PxrMix(
    color color1 = 0;                      // where mix is 0
    color color2 = 1;                      // where it is 1
    float mix = 0.5;                       // how much of color2
    output varying color resultRGB = 0;    // the mix
    output varying float resultR = 0;      // its first component
)
{
    resultRGB = color1 * (1 - mix) + color2 * mix;
    resultR = comp(resultRGB, 0);
}
