// A picture that no light changes.
surface paintedconstant(
    string texturename = ""; // texture that multiplies Cs; "" = none
) {
    Oi = Os;
    Ci = Os * Cs;
    if (texturename != "")
        Ci *= color texture(texturename);
}
