// A classic surface is read as a material: a Lambert lobe and a glossy one, with their weights.
// Expect diffuse 0.5 u, specular 0.25, presence 1.
surface surface_closures(float Kd = 0.5; float Ks = 0.25; float roughness = 0.1;)
{
    normal Nf = faceforward(normalize(N), I);
    Oi = Os;
    Ci = Os * (u * Kd * diffuse(Nf) + Ks * specular(Nf, -normalize(I), roughness));
}
