// The rings of vertices that make a tube of a curve.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/vec.h"

namespace kanuka::geom {

// Where the vertices of a tube's ring stand: angles from one side over the front, where the camera is, to the
// other and around. By Cauchy's formula the mean width of what is convex is its outline over pi: so the ring
// is larger than the circle that it stands for by what makes the outlines equal.
class Ring {
  public:
    explicit Ring(int front) {
        if (front == 0) {
            // A triangle is too narrow by 9 % to too wide by 5 %; turned so, it is right for the camera.
            const float turn = std::acos(3 / Pi);
            for (int k = 0; k < 3; k++)
                angle.push_back(Pi / 2 + turn + float(k) * (2 * Pi / 3));
            scale = 2 * Pi / (3 * std::sqrt(3.0f));
            return;
        }
        const int back = std::max(4, (front + 3) / 4);
        for (int k = 0; k < front; k++)
            angle.push_back(Pi * float(k) / float(front));
        for (int k = 0; k < back; k++)
            angle.push_back(Pi * (1 + float(k) / float(back)));
        const auto chords = [](int n) { return float(n) * std::sin(Pi / float(2 * n)); };
        scale = Pi / (chords(front) + chords(back));
    }
    static int size(int front) { return front == 0 ? 3 : front + std::max(4, (front + 3) / 4); }

    std::vector<float> angle;
    float scale; // of the radius
};

} // namespace kanuka::geom
