// For tests of what is handed to the tracer as a mesh: a view of known measures.
#pragma once

#include <cmath>

#include "geom/test_surfaces.h"
#include "geom/traced_mesh.h"

namespace kanuka::geom::testing {

// From +z: without perspective, or from a place on that axis.
class Eye : public Viewpoint {
  public:
    float per_pixel = 1, pixels = 1,
          distance = 0;            // micropolygon edges a pixel, pixels a unit (at distance 1)
    float edge = 1, chord = 0.25f; // pixels of a micropolygon, and what chords may be off by
    double most = 1 << 25;
    float cells(const Vec3f& a, const Vec3f& b) const override {
        if (distance == 0)
            return length(b - a) * pixels * per_pixel;
        double sum = 0; // of small steps
        for (int i = 0; i < 64; i++)
            sum += double(length(b - a)) / 64 * double(pixels_per_unit(lerp((float(i) + 0.5f) / 64, a, b)));
        return float(sum) * per_pixel;
    }
    float pixels_per_unit(const Vec3f& p) const override {
        return distance == 0 ? pixels : pixels / length(Vec3f(0, 0, distance) - p);
    }
    Vec3f towards_camera(const Vec3f& p) const override {
        return distance == 0 ? Vec3f(0, 0, 1) : normalize(Vec3f(0, 0, distance) - p);
    }
    bool has_camera() const override { return true; }
    double most_vertices() const override { return most; }
    float edge_pixels() const override { return edge; }
    float chord_pixels() const override { return chord; }
};

inline MeshParts curves(const scene::Primitive& p, const Eye& eye, bool polygons = false) {
    MeshParts out;
    Journal journal;
    EXPECT_TRUE(mesh_from_curves(p, std::get<scene::Curves>(p.geometry), {}, eye, polygons, journal, out));
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    return out;
}

inline Vec3f at(const std::vector<float>& all, size_t i, size_t stride) {
    return {all[i], all[i + stride], all[i + 2 * stride]};
}

} // namespace kanuka::geom::testing
