// Pattern of RIS: heights and vectors of pictures in the terms of PxrDisplace.
surface PxrDispTransform(
    float dispType = 1;                         // 1: dispScalar; 2 and above: dispVector
    varying float dispScalar = 0;               // a height
    varying vector dispVector = vector(0, 0, 0); // a vector
    float vectorSpace = 2;                      // of it: 1 world, 2 object, 3 tangents and normal, 4 current
    float dispRemapMode = 1;                    // 1: as it is; 2: dispCenter stays, 0 sinks, 1 rises; 3: from sunk to risen
    float dispCenter = 0.5;                     // of mode 2
    float dispDepth = 1;                        // how far it sinks
    float dispHeight = 1;                       // how far it rises
    output varying float resultF = 0;           // for dispScalar of PxrDisplace
    output varying vector resultXYZ = vector(0, 0, 0); // for its dispVector
)
{
    vector v = dispVector;
    if (dispRemapMode == 2) { // of a picture: each component about the centre
        v = (v - vector(dispCenter, dispCenter, dispCenter)) / max(1 - dispCenter, 0.001);
        float d = dispScalar - dispCenter;
        resultF = d > 0 ? dispHeight * d / max(1 - dispCenter, 0.001) : dispDepth * d / max(dispCenter, 0.001);
    } else if (dispRemapMode == 3) {
        resultF = mix(-dispDepth, dispHeight, dispScalar);
    } else {
        resultF = dispScalar;
    }
    if (dispType >= 2) {
        if (vectorSpace == 1)
            v = vtransform("world", "object", v);
        else if (vectorSpace == 3)
            v = vtransform("object", xcomp(v) * normalize(dPdu) + ycomp(v) * normalize(dPdv) +
                                     zcomp(v) * normalize(vector(N)));
        else if (vectorSpace == 4)
            v = vtransform("object", v);
        resultXYZ = v;
    }
}
