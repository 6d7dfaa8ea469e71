// The ground that keeps blobs away: a file of depths (RISpec 5.6, operation 1003), as shadow maps of old have
// them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/vec.h"

namespace kanuka::geom {

// Four-byte magic 2F0867AB, width and height in two bytes each, the matrices from world space to the screen
// ([-1, 1]², y up) and to the camera, 16 floats each, then depths along the camera's z, row by row from the
// top; all in either byte order. Thread safety: const members may run at the same time.
class GroundMap {
  public:
    static constexpr double Nothing = 1e30; // depths from here on: no ground
    struct Range {
        double lo, hi;
    };
    // Null with a reason where it cannot be read.
    static std::shared_ptr<const GroundMap> read(const std::string& path, std::string& why);

    // How far p, in world space, is above the ground, along the camera's z; Nothing beside the map.
    double height(const double* p) const;
    // Bounds of that over a parallelepiped of eight corners.
    Range heights(const double (*corners)[3]) const;

  private:
    struct Level { // least and largest depths of 2^k texels each way, one beyond on each side
        int width, height;
        std::vector<float> lo, hi;
    };
    void make_levels();
    bool raster(const double* p, double* xy) const; // false: not before the camera
    double depth(double x, double y) const;

    int m_width = 0, m_height = 0;
    Transform m_screen_from_world, m_camera_from_world;
    std::vector<float> m_depths;
    std::vector<Level> m_levels;
};

} // namespace kanuka::geom
