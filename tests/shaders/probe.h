// A test of the compiler: statements between PROBE(name) and END that leave a color in r, of any sign.
// What stands in NAME.txt is r at every vertex of a 5 x 4 grid: P = (u, v, 0), N = +z, s = u, t = v.

#define PROBE(name) PROBE_OF(name, )
#define PROBE_OF(name, parameters)                                                                           \
    class name(parameters) {                                                                                 \
      public                                                                                                 \
        void mnk_init(output MnkObjectProperties o; output MnkMaterial material) {                           \
            MnkMaterialBoundary boundary = CreateBoundary(material);                                         \
            AddLobe(boundary, "plus", DiffuseEmission());                                                    \
            AddLobe(boundary, "minus", DiffuseEmission());                                                   \
        }                                                                                                    \
      public                                                                                                 \
        void mnk_prelighting(output MnkMaterialBoundary boundary) {                                          \
            color r = 0;

#define END                                                                                                  \
    SetLobe(boundary, "plus", 1, DiffuseEmission("radiance", r));                                            \
    SetLobe(boundary, "minus", 1, DiffuseEmission("radiance", -r));                                          \
    }                                                                                                        \
    }
