// Fades with the exponential of the distance from the eye.
volume fog(
    float distance = 1;   // over which all but 1/e fades
    color background = 0; // colour to fade to
) {
    float faded = 1 - exp(-length(I) / distance);
    Ci = mix(Ci, background, faded);
    Oi = mix(Oi, color(1, 1, 1), faded);
}
