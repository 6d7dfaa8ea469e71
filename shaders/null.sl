// Leaves surface colour and opacity as they come: a constant surface.
surface null() {
}
