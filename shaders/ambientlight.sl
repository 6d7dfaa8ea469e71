// Light of the same strength from everywhere: no illuminate or solar statement, so no direction.
light ambientlight(
    float intensity = 1;  // scales lightcolor
    color lightcolor = 1; // colour of the light
) {
    Cl = intensity * lightcolor;
}
