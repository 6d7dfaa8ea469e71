// Transformations that change with time.
#pragma once

#include <span>
#include <vector>

#include "base/vec.h"

namespace kanuka {

struct TransformKey {
    double time = 0;
    Transform transform;
    bool operator==(const TransformKey&) const = default;
};

// Between keys, translation and stretch go linearly and rotation along the shortest arc at even speed: every
// matrix is taken apart into M = T R S by polar decomposition (Shoemake and Duff 1992, Matrix Animation and
// Polar Decomposition), R as a quaternion. Before the first key and after the last it stands still.
// Thread safety: const members may run at the same time.
class MotionPath {
  public:
    MotionPath() = default;
    // `before` and `after` stay as they are: before * key(t) * after. Keys must rise in time; the last row of
    // their matrices is taken as 0 0 0 1.
    explicit MotionPath(std::span<const TransformKey> keys, const Transform& before = {},
                        const Transform& after = {});

    Transform at(double time) const;
    void at(double time, float* row_major_3x4) const;
    bool moves() const { return m_keys.size() > 1; }
    // Where its pieces meet.
    std::vector<double> times() const;
    // No point of the box strays further than this from the straight and even way between where it is at t0
    // and at t1. No key may lie between them.
    double deviation(double t0, double t1, const Bounds3f& box) const;
    // The angle of all turns, in radians.
    double turning() const;
    // Where a box is at even times from 0 to 1, two or more. What moves lies in between wherever these boxes
    // are interpolated, with room for rays that are rounded on their way to it. Not finite where the path is
    // not.
    void bound(const Bounds3f& box, std::span<Bounds3f> at_times) const;
    // At how many times such boxes fit well.
    int times_to_bound() const;

  private:
    struct Key {
        double time = 0;
        std::array<double, 3> translation{};
        std::array<double, 4> rotation{1, 0, 0, 0}; // w x y z
        std::array<double, 9> stretch{1, 0, 0, 0, 1, 0, 0, 0, 1};
        double angle = 0; // of the quaternions, to the next key: half of the turn
    };
    struct Place {
        const Key *a, *b;
        double f;
    };
    Place place(double time) const;

    std::vector<Key> m_keys;
    Transform m_after;
    bool m_has_after = false;
};

// key(t) of `outer` times key(t) of `inner`, at all times of both. An empty list stands for its still matrix.
std::vector<TransformKey> compose(std::span<const TransformKey> outer, const Transform& still_outer,
                                  std::span<const TransformKey> inner, const Transform& still_inner);

} // namespace kanuka
