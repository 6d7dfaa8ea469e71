// A texture that sticks to the surface while it bends.
surface sticky_texture(
    string texturename = ""; // over (s, t)
    float Kd = 0.8;          // diffuse reflection, as a part of the texture
    float Ka = 0.2;          // ambient reflection, as a part of the texture
)
{
    normal Nf = faceforward(normalize(N), I);
    color paint = Cs;
    if (texturename != "")
        paint *= color texture(texturename);
    Oi = Os;
    Ci = Oi * paint * (Ka * ambient() + Kd * diffuse(Nf));
}
