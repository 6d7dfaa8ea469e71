// Limits each component to the coverage, so that pictures are composed without values above white.
imager clamptoalpha() {
    Ci = min(Ci, color(alpha));
}
