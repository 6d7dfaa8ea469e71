// The codes of a Blobby (RISpec 3.2, table 5.3, and PRMan's application note) as nodes of its field.
#include <algorithm>
#include <cmath>

#include "geom/blobby_field.h"

namespace kanuka::geom {

// The least and the most that lengths grow by: roots of the eigenvalues of A = M^T M (Smith, "Eigenvalues of
// a symmetric 3 x 3 matrix", 1961).
static std::pair<double, double> stretches(const Transform& t) {
    double a[3][3];
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            a[i][j] = t.m[0][i] * t.m[0][j] + t.m[1][i] * t.m[1][j] + t.m[2][i] * t.m[2][j];
    const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3;
    double p = 0;
    for (size_t i = 0; i < 3; i++) {
        a[i][i] -= mean;
        for (size_t j = 0; j < 3; j++)
            p += a[i][j] * a[i][j] / 6;
    }
    p = std::sqrt(p);
    const double det = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                       a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                       a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
    const double angle = p > 0 ? std::acos(std::clamp(det / (2 * p * p * p), -1.0, 1.0)) / 3 : 0;
    constexpr double Third = 2.0943951023931953;
    return {std::sqrt(std::max(mean + 2 * p * std::cos(angle + Third), 0.0)),
            std::sqrt(mean + 2 * p * std::cos(angle))};
}

class BlobbyField::Reader {
  public:
    Reader(BlobbyField& field, const scene::Blobby& blobby, const Location& where, Journal& journal)
        : m_field(field), m_blobby(blobby), m_where(where), m_journal(journal) {}

    void run() {
        const auto& code = m_blobby.code;
        while (m_at < code.size()) {
            const int32_t op = code[m_at++];
            size_t count = 0;
            if (!count_operands(op, count))
                break; // how long it is is not known
            const int32_t* operand = code.data() + m_at;
            m_at += count;
            if (op >= Constant)
                leaf(op, operand, count);
            else
                combination(op, operand, count);
        }
        number_constants();
        if (m_bad > 0)
            m_journal.error(m_where,
                            "Blobby: " + std::to_string(m_bad) + " operations were taken as zero: " + m_why);
    }

  private:
    enum Code : int32_t { Constant = 1000, Ellipsoid, Segment, Ground, PlugIn };

    // What is wrong becomes a zero.
    void fail(const std::string& reason) {
        m_bad++;
        if (m_why.empty())
            m_why = "operation " + std::to_string(m_field.m_nodes.size()) + " " + reason;
        m_field.m_nodes.push_back({});
    }

    bool count_operands(int32_t op, size_t& count) {
        const auto& code = m_blobby.code;
        count = op >= Constant ? (op == PlugIn ? 5 : op == Ground ? 2 : 1) : op == 4 || op == 5 ? 2 : 1;
        // A count comes first; of what is not known too, as AIR's 9000.
        if ((op >= 0 && op <= 3) || op > PlugIn) {
            if (m_at >= code.size() || code[m_at] < 0) {
                fail("has no number of operands");
                return false;
            }
            count = size_t(code[m_at++]);
        } else if (op < 0 || (op > 7 && op < Constant)) {
            fail("has the unknown code " + std::to_string(op));
            return false;
        }
        if (count > code.size() - m_at) {
            fail("lacks operands");
            return false;
        }
        return true;
    }

    const float* parameters(int32_t at, size_t n) const {
        const auto& floats = m_blobby.floats;
        if (at < 0 || size_t(at) + n > floats.size())
            return nullptr;
        for (size_t i = 0; i < n; i++)
            if (!std::isfinite(floats[size_t(at) + i]))
                return nullptr;
        return floats.data() + at;
    }

    void leaf(int32_t op, const int32_t* operand, size_t count) {
        Node node; // zero
        if (op != Constant)
            node.leaf = m_field.m_leaves++;
        if (op > PlugIn) {
            m_journal.warning(m_where, "Blobby: the operation " + std::to_string(op) + " is not known; its " +
                                           std::to_string(count) +
                                           " operands were passed over, and it adds nothing. Put ellipsoids "
                                           "(1001) or segments (1002) in its place");
            m_field.m_nodes.push_back(std::move(node));
            return;
        }
        if (op == PlugIn) { // name; number and place of its floats; of its strings
            const bool named = operand[0] >= 0 && size_t(operand[0]) < m_blobby.strings.size();
            m_journal.warning(m_where, "Blobby: operation 1004, the plug-in \"" +
                                           (named ? m_blobby.strings[size_t(operand[0])] : std::string()) +
                                           "\", adds nothing: blobs by plug-ins are not run. Put ellipsoids "
                                           "(1001) or segments (1002) in its place");
            m_field.m_nodes.push_back(std::move(node));
            return;
        }
        const size_t n = op == Constant ? 1 : op == Ellipsoid ? 16 : op == Segment ? 23 : 4;
        const int32_t at = operand[op == Ground ? 1 : 0];
        const float* f = parameters(at, n);
        if (!f)
            return fail("has no finite parameters at " + std::to_string(at));
        if (op == Ground)
            return ground(std::move(node), operand[0], f);
        if (op != Constant)
            return blob(std::move(node), op == Segment, f);
        node.op = Op::Constant;
        node.constant = double(f[0]);
        m_field.m_nodes.push_back(std::move(node));
    }

    // f: A B C D of a repelling plane.
    void ground(Node node, int32_t file, const float* f) {
        if (file < 0 || size_t(file) >= m_blobby.strings.size())
            return fail("has no string " + std::to_string(file) + ", the name of a file of depths");
        std::string reason;
        node.ground = GroundMap::read(m_blobby.strings[size_t(file)], reason);
        node.op = Op::Ground;
        node.reach = double(f[0]), node.barrier = double(f[1]);
        node.bulge = double(f[2]), node.swell = double(f[3]);
        if (!node.ground || !(node.reach > 0) || !(node.barrier >= 0) || !(node.bulge > 0))
            return fail("repels nothing: " +
                        (node.ground ? "its heights must be positive, A B C D of its floats" : reason));
        m_field.m_nodes.push_back(std::move(node));
    }

    // f: of a segment its ends and radius first; the rows of the matrix, as RIB has them.
    void blob(Node node, bool segment, const float* f) {
        const float* matrix = segment ? f + 7 : f;
        Transform to_object;
        for (size_t r = 0; r < 4; r++)
            for (size_t c = 0; c < 4; c++)
                to_object.m[c][r] = double(matrix[4 * r + c]);
        try {
            node.to_blob = to_object.inverse();
        } catch (const Error&) {
            return fail("is flattened by its matrix");
        }
        node.op = segment ? Op::Segment : Op::Ellipsoid;
        double from[3] = {0, 0, 0}, to[3] = {0, 0, 0}, radius = 1;
        if (segment) {
            double length2 = 0;
            for (int c = 0; c < 3; c++) {
                node.p[c] = from[c] = double(f[c]);
                to[c] = double(f[3 + c]);
                node.d[c] = to[c] - from[c];
                length2 += node.d[c] * node.d[c];
            }
            radius = std::abs(double(f[6]));
            if (!(radius > 0))
                return fail("has no radius");
            node.inverse_radius = 1 / radius;
            node.inverse_length2 = length2 > 0 ? 1 / length2 : 0;
        }
        add_support(node, to_object, from, to, radius);
        m_field.m_nodes.push_back(std::move(node));
    }

    void add_support(Node& node, const Transform& to_object, const double* from, const double* to,
                     double radius) {
        // Frobenius norms bound how much lengths grow.
        double there = 0, back = 0;
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c < 3; c++) {
                there += to_object.m[r][c] * to_object.m[r][c];
                back += node.to_blob.m[r][c] * node.to_blob.m[r][c];
            }
        node.stretch = std::sqrt(back) * node.inverse_radius;
        Ball ball;
        double mid[3], half = 0;
        for (int c = 0; c < 3; c++) {
            mid[c] = (from[c] + to[c]) / 2;
            half += (to[c] - from[c]) * (to[c] - from[c]) / 4;
        }
        take(to_object, mid, 1, ball.center);
        ball.radius = (std::sqrt(half) + radius) * std::sqrt(there);
        // Half of the support's: at the tip of an ellipsoid of half axes a and b, b^2 / a.
        const auto [least, most] = stretches(to_object);
        ball.bend = 0.5 * radius * least * least / most;
        node.ball = int(m_field.m_supports.size());
        m_field.m_supports.push_back(ball);
    }

    void combination(int32_t op, const int32_t* operand, size_t count) {
        constexpr Op ops[] = {Op::Add,      Op::Multiply, Op::Max,    Op::Min,
                              Op::Subtract, Op::Divide,   Op::Negate, Op::Add};
        Node node;
        node.op = ops[op];
        bool good = true;
        for (size_t k = 0; k < count; k++) {
            good &= operand[k] >= 0 && size_t(operand[k]) < m_field.m_nodes.size();
            node.operands.push_back(operand[k]);
        }
        if (!good || count == 0)
            return fail("takes results that are not there yet");
        // RISpec's table 5.3 has the subtrahend first.
        if (op == 4)
            std::swap(node.operands[0], node.operands[1]);
        m_field.m_nodes.push_back(std::move(node));
    }

    // PRMan's application note counts constants among the leaves that have values, RISpec does not: nleaf
    // tells.
    void number_constants() {
        const auto constants = std::ranges::count(m_field.m_nodes, Op::Constant, &Node::op);
        if (m_bad > 0 || m_field.m_leaves == m_blobby.leaves ||
            m_field.m_leaves + constants != m_blobby.leaves)
            return;
        m_field.m_leaves = 0;
        for (Node& node : m_field.m_nodes)
            if (node.leaf >= 0 || node.op == Op::Constant)
                node.leaf = m_field.m_leaves++;
    }

    BlobbyField& m_field;
    const scene::Blobby& m_blobby;
    const Location& m_where;
    Journal& m_journal;
    size_t m_at = 0; // in the code
    size_t m_bad = 0;
    std::string m_why; // the first one
};

bool BlobbyField::prepare(const scene::Blobby& blobby, const Transform& world_from_object,
                          const Location& where, Journal& journal) {
    m_world_from_object = world_from_object;
    Reader(*this, blobby, where, journal).run();
    return !m_nodes.empty() && !m_supports.empty();
}

} // namespace kanuka::geom
