// Pattern of RIS: a picture over (s, t).
surface PxrTexture(
    string filename = "";                  // the picture; "" = missingColor
    float invertT = 1;                     // 1: t rises upwards in the picture
    color missingColor = color(1, 0, 1);   // where there is no picture
    output varying color resultRGB = 0;    // colour
    output varying float resultR = 0;      // its first component
    output varying float resultG = 0;      // the second
    output varying float resultB = 0;      // the third
)
{
    resultRGB = missingColor;
    if (filename != "")
        resultRGB = color texture(filename, s, t + invertT * (1 - 2 * t));
    resultR = comp(resultRGB, 0);
    resultG = comp(resultRGB, 1);
    resultB = comp(resultRGB, 2);
}
