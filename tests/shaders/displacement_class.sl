// mnk_displacement moves P and bends N. Expect P.z = 0.1 u, N leaning against u.
class displacement_class(float height = 0.1;)
{
    public void mnk_displacement(output point P; output normal N)
    {
        P += normalize(N) * height * u;
        N = normalize(calculatenormal(P));
    }
}
