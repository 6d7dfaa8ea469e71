// The field of a Blobby: leaves with bounded support and the operations that combine them.
#pragma once

#include <vector>

#include "base/error.h"
#include "base/vec.h"
#include "geom/ground_map.h"
#include "scene/scene.h"

namespace kanuka::geom {

// A value with its gradient.
struct Dual {
    double v = 0, x = 0, y = 0, z = 0;
};

class BlobbyField {
  public:
    static constexpr double Surface = 0.421875; // (1 - 1/4)^3: a lone blob is half of its support
    // Bad codes are reported; false = nothing is left.
    bool prepare(const scene::Blobby& blobby, const Transform& world_from_object, const Location& where,
                 Journal& journal);

    struct Interval {
        double lo = 0, hi = 0;
    };
    // A program for a box: leaves that do not reach it are zero there, and what is zero is left out of sums.
    // Values are the same bits as the whole program's.
    struct Local {
        std::vector<int> nodes;      // in order; the last is the result
        std::vector<char> zero;      // of all nodes
        bool crosses = false;        // the surface may pass through the box
        std::vector<double> scratch; // of all nodes
        std::vector<Dual> duals;
    };
    void localize(const double* lo, const double* hi, const Local* outer, Local& local) const;
    double value(const double* p, Local& local) const;
    Dual dual(const double* p, Local& local) const;
    // How much each leaf has to say at p; adds up to 1.
    void influences(const double* p, Local& local, std::vector<double>& by_leaf) const;

    struct Ball { // holds a leaf's support
        double center[3], radius;
        double bend; // radius of curvature of the leaf's own surface, where it bends most
    };
    const std::vector<Ball>& supports() const { return m_supports; } // of leaves with one

  private:
    enum class Op {
        Constant,
        Ellipsoid,
        Segment,
        Ground,
        Zero,
        Add,
        Multiply,
        Max,
        Min,
        Subtract,
        Divide,
        Negate
    };
    class Reader; // blobby_reader.cpp
    struct Node;
    // A point (w = 1) or vector (w = 0) through a transformation.
    static void take(const Transform& m, const double* p, double w, double* q);
    static double squared(const Node& node, const double* p, double* gradient);
    struct Node {
        Op op = Op::Zero;
        int leaf = -1;
        double constant = 0;
        Transform to_blob;           // ellipsoid, segment: of object space
        double stretch = 1;          // the most that lengths grow by it
        double p[3] = {}, d[3] = {}; // of the segment, in blob space
        double inverse_radius = 1, inverse_length2 = 0;
        int ball = -1;
        std::shared_ptr<const GroundMap> ground;
        double reach = 0, barrier = 0, bulge = 0, swell = 0; // A, B, C, D of a repelling plane
        std::vector<int> operands;
    };
    double ground_value(const Node& node, const double* p) const;
    Interval ground_range(const Node& node, const double* lo, const double* hi) const;
    Interval leaf_range(const Node& node, const double* lo, const double* hi) const;
    template <class T, class Leaf>
    T run(Local& local, std::vector<T>& values, Leaf leaf) const;

    std::vector<Node> m_nodes;
    std::vector<Ball> m_supports;
    Transform m_world_from_object; // where the ground lies
    int m_leaves = 0;
};

} // namespace kanuka::geom
