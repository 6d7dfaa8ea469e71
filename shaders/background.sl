// Fills what no surface covers.
imager background(
    color bgcolor = 1; // colour of the background
) {
    Ci += (1 - alpha) * bgcolor;
    Oi = 1;
    alpha = 1;
}
