// Pushes the surface out by a texture.
displacement bumpy(
    float Km = 1;            // height of white, in object units
    string texturename = ""; // heights over (s, t); "" = none
) {
    float height = 0;
    if (texturename != "")
        height = Km * float texture(texturename);
    P += height * normalize(N);
    N = calculatenormal(P);
}
