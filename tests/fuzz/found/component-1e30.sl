surface component() {
    Ci = comp(Cs, 1e30);
}
