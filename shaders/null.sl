// Leaves surface colour and opacity as they come: a material without lobes.
surface null() {
}
