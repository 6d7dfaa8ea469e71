// Transformations that change with time.
#pragma once

#include <cstddef>
#include <functional>
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
    void at(double time, Transform& first_three_rows) const;
    void at(double time, float* row_major_3x4) const;
    bool moves() const { return m_first.begin < m_first.end || !m_more.empty(); }
    // at() reads so much of it from its first byte on, if it is one piece: less where that does not turn.
    size_t bytes_read() const {
        return m_first.angle > 0 ? sizeof(MotionPath)
                                 : sizeof(std::vector<Piece>) + offsetof(Piece, to) + sizeof(Piece::to);
    }
    // Where its pieces meet.
    std::vector<double> times() const;
    // No point of the box strays further than this from the straight and even way between where it is at t0
    // and at t1. No key may lie between them.
    double deviation(double t0, double t1, const Bounds3f& box) const;
    // The angle of all turns, in radians.
    double turning() const;
    // Where a box is at even times from 0 to 1, two or more. What moves lies in between wherever these boxes
    // are interpolated, with room for rays that are rounded on their way to it. Not finite where the path is
    // not. `around`: what is in the box, where a matrix puts it, for boxes that fit better than those around
    // the box itself.
    using Around = std::function<Bounds3f(const Transform&)>;
    void bound(const Bounds3f& box, std::span<Bounds3f> at_times, const Around& around = {}) const;
    // At how many times such boxes fit well: those that turn by so many radians in between do.
    int times_to_bound(double turn_a_step) const;

  private:
    // Between two keys. Rays among many instances ask paths all over memory: what most of them read is short,
    // and lies together.
    struct Piece {
        double begin = 0, end = 0;
        double angle = 0, cotangent = 0, per_sine = 0; // of the quaternions; 0: it does not turn
        // Rows, 3x4: what is turned and then moved, with all that comes before; of a piece that does not
        // turn, everything.
        std::array<double, 12> from{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, to = from;
        std::array<double, 4> rotation_from{}, rotation_to{}; // w x y z
        std::array<double, 3> translation_from{}, translation_to{};
    };
    size_t count() const { return 1 + m_more.size(); }
    const Piece& piece(size_t i) const { return i == 0 ? m_first : m_more[i - 1]; }
    const Piece& piece_at(double time) const;

    std::vector<Piece> m_more; // behind the first
    Piece m_first;
};

// key(t) of `outer` times key(t) of `inner`, at all times of both. An empty list stands for its still matrix.
std::vector<TransformKey> compose(std::span<const TransformKey> outer, const Transform& still_outer,
                                  std::span<const TransformKey> inner, const Transform& still_inner);

} // namespace kanuka
