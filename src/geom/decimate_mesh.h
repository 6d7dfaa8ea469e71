// A mesh while its edges are collapsed: who is beside whom, what may be joined, and where the points of the
// mesh that it was lie on it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geom/decimate.h"
#include "geom/quadric_error.h"

namespace kanuka::geom {

class DecimatedMesh {
  public:
    explicit DecimatedMesh(const ColoredMesh& mesh);

    uint32_t faces() const { return uint32_t(m_faces.size()); }
    const std::array<uint32_t, 3>& face(uint32_t f) const { return m_faces[f]; }
    // About the middle of the mesh, where digits are not lost to its place.
    const Vec3d& point(uint32_t v) const { return m_points[v]; }
    Vec3f outside(const Vec3d& p) const {
        return {float(p.x + m_origin.x), float(p.y + m_origin.y), float(p.z + m_origin.z)};
    }
    double diagonal() const { return m_diagonal; }

    std::vector<uint32_t> neighbours(uint32_t v) const; // rising
    int faces_at(uint32_t a, uint32_t b) const;         // of an edge
    bool on_border(uint32_t v) const { return m_border[v]; }
    bool locked(uint32_t v) const { return m_locked[v]; } // no manifold is around it

    // Is the surface one as before, where a and b are joined?
    bool may_join(uint32_t a, uint32_t b) const;
    // Is a face turned over, or nothing but a line, where they are joined at p?
    bool turns_over(uint32_t a, uint32_t b, const Vec3d& p) const;
    // Are points of the mesh that lie on faces around within `most` of what they become? `distance2`: the
    // largest distance, squared. What it finds join() needs.
    bool points_stay_near(uint32_t a, uint32_t b, const Vec3d& p, double most, double& distance2);
    // b goes into a. Returns how many faces went.
    uint32_t join(uint32_t a, uint32_t b, const Vec3d& p);

  private:
    static constexpr uint32_t None = ~0u;
    bool has(uint32_t f, uint32_t v) const {
        return m_faces[f][0] == v || m_faces[f][1] == v || m_faces[f][2] == v;
    }
    std::array<Vec3d, 3> moved(uint32_t f, uint32_t a, uint32_t b, const Vec3d& p) const;

    Vec3d m_origin;
    double m_diagonal = 0;
    std::vector<Vec3d> m_points;
    std::vector<Vec3f> m_before; // the points of the mesh, about the same middle
    std::vector<std::array<uint32_t, 3>> m_faces;
    std::vector<std::vector<uint32_t>> m_around; // faces of each vertex, rising
    std::vector<char> m_border, m_locked;
    std::vector<uint32_t> m_on_face, m_next; // lists of points: the first on each face, the next of each
    struct Moved {
        uint32_t point, face;
    };
    std::vector<Moved> m_moved;   // what points_stay_near() has found
    std::vector<uint32_t> m_stay; // faces around that are not those of the edge
};

} // namespace kanuka::geom
