// A picture on what is dull.
surface paintedmatte(
    float Ka = 1;            // ambient reflection, as a part of the colour
    float Kd = 1;            // diffuse reflection, as a part of the colour
    string texturename = ""; // texture that multiplies Cs; "" = none
) {
    color painted = Cs;
    if (texturename != "")
        painted *= color texture(texturename);
    Oi = Os;
    Ci = Os * painted * (Ka * ambient() + Kd * diffuse(faceforward(normalize(N), I)));
}
