// The same colour in all directions, whatever the light: an emitter of radiance Cs.
surface constant() {
    Oi = Os;
    Ci = Oi * Cs;
}
