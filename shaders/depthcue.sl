// Fades what lies between two depths of the picture into a background colour.
volume depthcue(
    float mindistance = 0; // depth where fading begins, 0 = near clipping plane
    float maxdistance = 1; // depth where nothing but background is left, 1 = far clipping plane
    color background = 0;  // colour to fade to
) {
    float faded = clamp((depth(P) - mindistance) / (maxdistance - mindistance), 0, 1);
    Ci = mix(Ci, background, faded);
    Oi = mix(Oi, color(1, 1, 1), faded);
}
