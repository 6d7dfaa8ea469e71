// Light of the same strength from everywhere.
light ambientlight(
    float intensity = 1;  // scales lightcolor
    color lightcolor = 1; // colour of the light
) {
    L = 0; // tells that it comes from no direction
    Cl = intensity * lightcolor;
}
