// A cone of light with a soft edge.
light spotlight(
    float intensity = 1;                  // scales lightcolor; the strength on the axis at distance one
    color lightcolor = 1;                 // colour of the light
    point from = point "shader" (0, 0, 0); // where it stands
    point to = point "shader" (0, 0, 1);   // a point on its axis
    float coneangle = radians(30);        // half the opening of the cone, in radians
    float conedeltaangle = radians(5);    // width of the soft edge inside the cone, in radians
    float beamdistribution = 2;           // falls off with this power of the cosine to the axis
) {
    vector axis = normalize(to - from);
    float outer = cos(coneangle);
    float inner = cos(coneangle - conedeltaangle);
    illuminate(from, axis, coneangle) {
        float cosine = (L . axis) / length(L);
        float falloff = pow(cosine, beamdistribution) / (L . L);
        Cl = smoothstep(outer, inner, cosine) * falloff * intensity * lightcolor;
    }
}
