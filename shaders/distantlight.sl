// Parallel light, as from a sun.
light distantlight(
    float intensity = 1;                  // scales lightcolor
    color lightcolor = 1;                 // colour of the light
    point from = point "shader" (0, 0, 0); // it shines along the line from here
    point to = point "shader" (0, 0, 1);   // to here
) {
    solar(to - from, 0)
        Cl = intensity * lightcolor;
}
