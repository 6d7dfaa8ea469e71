// Random primitives of every kind, flat to curved, and for each what stands there (test_oracles.h).
#pragma once

#include <random>

#include "dice/test_oracles.h"
#include "dice/test_scene.h"

namespace kanuka::dice::test {

enum class Kind {
    Convex,     // a polygon
    Concave,    // a polygon
    Holed,      // a general polygon
    FlatMesh,   // points-polygons in a plane, of triangles, quads and n-gons
    Polyhedron, // points-polygons that close
    Bilinear,
    Bicubic,
    BilinearMesh,
    BicubicMesh,
    Nurbs,
    RationalDisc,
    Trimmed,
    Sphere,
    Cone,
    Cylinder,
    Hyperboloid,
    Paraboloid,
    Disk,
    Torus,
    Catmull,
    CatmullSheet,
    Loop,
    Balls,
    Discs,
    Ribbon,
    Blob,
};
constexpr int Kinds = int(Kind::Blob) + 1;
constexpr const char* KindNames[Kinds] = {"convex polygon",
                                          "concave polygon",
                                          "polygon with holes",
                                          "flat mesh",
                                          "polyhedron",
                                          "bilinear patch",
                                          "bicubic patch",
                                          "bilinear patch mesh",
                                          "bicubic patch mesh",
                                          "NURBS",
                                          "rational disc",
                                          "trimmed NURBS",
                                          "sphere",
                                          "cone",
                                          "cylinder",
                                          "hyperboloid",
                                          "paraboloid",
                                          "disk",
                                          "torus",
                                          "Catmull-Clark, closed",
                                          "Catmull-Clark",
                                          "Loop",
                                          "points: spheres",
                                          "points: disks",
                                          "ribbon",
                                          "blobby"};

struct Shape {
    scene::Primitive primitive;
    Hit hit;              // what stands there, of the two the one that is given
    Soup soup;            // in object space
    Loop2 outline_points; // of flat polygons: all loops, to know how long their outline is
    std::vector<size_t> outline_first;
    bool closed = false, flat = false;
    std::vector<D3> hull; // it lies within these points' hull
    std::string note;
};

class ShapeRandom {
  public:
    // `stretch`: the same thing in another shape.
    ShapeRandom(uint32_t seed, double stretch) : m_random(seed), m_stretch(1 + stretch) {}
    Shape shape;

  protected:
    double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(m_random); }
    int whole(int lo, int hi) { return std::uniform_int_distribution<int>(lo, hi)(m_random); }
    bool chance(double p) { return uniform(0, 1) < p; }
    double bend() { return chance(0.4) ? 0.0 : uniform(0.05, 0.6); } // how curved

    D3 rounded(const D3& p) const { // as a file holds it
        return {double(float(p.x * m_stretch)), double(float(p.y)), double(float(p.z))};
    }
    static std::vector<float> floats_of(const std::vector<double>& k) { return {k.begin(), k.end()}; }
    static std::vector<float> floats_of(const std::vector<D3>& points) {
        std::vector<float> out;
        for (const D3& p : points)
            out.insert(out.end(), {float(p.x), float(p.y), float(p.z)});
        return out;
    }
    void set(scene::Geometry geometry, const std::vector<D3>& points) {
        shape.primitive = primitive(std::move(geometry), floats_of(points));
        if (shape.hull.empty())
            shape.hull = points;
    }
    void box(double x, double y, double z0, double z1) {
        for (const double a : {-x, x})
            for (const double b : {-y, y})
                for (const double c : {z0, z1})
                    shape.hull.push_back({a, b, c});
    }

    std::mt19937 m_random;
    double m_stretch;
};

} // namespace kanuka::dice::test
