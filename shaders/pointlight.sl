// A point that shines in all directions, with the square of the distance.
light pointlight(
    float intensity = 1;                  // scales lightcolor; the strength at distance one
    color lightcolor = 1;                 // colour of the light
    point from = point "shader" (0, 0, 0); // where it stands
) {
    illuminate(from)
        Cl = intensity * lightcolor / (L . L);
}
