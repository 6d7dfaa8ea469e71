// Pattern of RIS: one minus a colour.
surface PxrInvert(
    color inputRGB = 0;                    // what
    output varying color resultRGB = 0;    // 1 - inputRGB
    output varying float resultR = 0;      // its first component
)
{
    resultRGB = color(1, 1, 1) - inputRGB;
    resultR = comp(resultRGB, 0);
}
