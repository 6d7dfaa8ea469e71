// Fewer triangles for a mesh that shaders have coloured: edges are collapsed, the cheapest first.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "base/vec.h"

namespace kanuka::geom {

struct ColoredMesh {
    std::vector<Vec3f> points, colors; // a colour each, linear
    std::vector<uint32_t> triangles;   // three each
};

struct DecimationLimits {
    // Points of the mesh stay within this distance of what is left of it, and colours are off by no more than
    // a tenth in the root mean square (of their square roots, which the eye sees as even steps).
    float error = std::numeric_limits<float>::infinity();
    // Where there is no error: the distance that counts as much as a step from black to white. 0 = a fiftieth
    // of the mesh.
    float color = 0;
    std::function<bool()> cancelled = [] { return false; };
};

// The collapses of a mesh, from the first to the last that keeps within the limits: a progressive mesh (Hoppe
// 1996), which can be cut anywhere.
class Decimation {
  public:
    Decimation() = default;
    Decimation(const ColoredMesh& mesh, const DecimationLimits& limits);

    struct Step {
        uint32_t removed, kept; // vertices; the one goes into the other, which is moved
        uint32_t faces;         // that went
        float cost;         // never falls: the error of this step or one before it, squared, times its area
        float error;        // never falls: how far a point of the mesh is from what is left of it
        Vec3f point, color; // of the vertex that is kept
    };
    const std::vector<Step>& steps() const { return m_steps; }
    // What `mesh`, the same as before, is after so many steps. Vertices keep their order.
    ColoredMesh after(const ColoredMesh& mesh, size_t steps) const;

  private:
    std::vector<Step> m_steps;
};

// How many steps of each leave no more than `faces` of all together; of those the ones with the least cost.
// Where that cannot be done: all steps.
struct DecimationShare {
    const Decimation* decimation;
    uint64_t faces = 0;  // before
    uint64_t copies = 1; // as often they count
    float weight = 1;    // of their costs
};
std::vector<size_t> share_faces(std::span<const DecimationShare> all, uint64_t faces);

} // namespace kanuka::geom
