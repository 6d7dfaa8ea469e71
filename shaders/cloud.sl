// Fog, smoke or a cloud in a closed shape, whose surface light passes as it comes: the same all through, or in a
// Volume as thick as a variable of its lattice says.
class cloud(
    color scattering = 1;       // turned aside, per metre
    color absorption = 0;       // taken away, per metre
    float droplets = 0;         // diameter of water droplets in micrometres, 5 to 50: how fog and clouds scatter;
                                // 0 = by the mean cosine
    float air = 0;              // 1: as air, blue more than red by the fourth power; scattering is that at 550 nm
    float meanCosine = 0;       // of the angle by which light is turned: 1 forwards, 0 anywhere, -1 back
    float priority = 0;         // where bodies overlap, the highest is there
)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialInterior interior = CreateInterior(material, "homogeneous", 1);
        if (droplets > 0)
            AddPhaseFunction(interior, "phase", MiePfrgb());
        else if (air > 0)
            AddPhaseFunction(interior, "phase", RayleighPfrgb());
        else
            AddPhaseFunction(interior, "phase", HenyeyGreensteinPfrgb());
    }

    public void mnk_interior(output MnkMaterialInterior interior)
    {
        SetAbsorption(interior, absorption);
        SetScattering(interior, scattering);
        SetPriority(interior, priority);
        if (droplets > 0)
            SetPhaseFunction(interior, "phase", MiePfrgb("diameter", droplets));
        else if (air > 0)
            SetPhaseFunction(interior, "phase", RayleighPfrgb("angstromExponent", 4 * air));
        else
            SetPhaseFunction(interior, "phase", HenyeyGreensteinPfrgb("meanCosine", color(meanCosine)));
    }
}
