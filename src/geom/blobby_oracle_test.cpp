// The field of a Blobby against RISpec 5.6, by recursion: values, gradients, what leaves have to say, and
// bounds over boxes, of random programs.
#include <cmath>
#include <random>

#include "geom/blobby_field.h"
#include "geom/test_traced.h"

namespace kanuka::geom {
namespace {

using namespace testing;

class Program {
  public:
    scene::Blobby blobby;

    explicit Program(uint32_t seed) : m_engine(seed) {
        const int leaves = 2 + pick(4);
        std::vector<int32_t> code;
        std::vector<float> floats;
        for (int i = 0; i < leaves; i++) {
            Node n;
            const int kind = pick(6);
            n.leaf = m_leaves;
            if (i > 0 && kind == 0) {
                n.op = 1000, n.leaf = -1;
                code.insert(code.end(), {1000, int32_t(floats.size())});
                n.f = {float(uniform(0, 0.5))};
            } else {
                m_leaves++;
                n.op = kind < 3 ? 1002 : 1001;
                code.insert(code.end(), {n.op, int32_t(floats.size())});
                if (n.op == 1002) {
                    for (int k = 0; k < 6; k++)
                        n.f.push_back(float(uniform(-1, 1)));
                    n.f.push_back(float(uniform(0.4, 1)));
                }
                // Rows of a matrix: turned a little, stretched, moved.
                const double c = std::cos(0.4 * i), s = std::sin(0.4 * i), x = uniform(0.7, 1.6),
                             y = uniform(0.7, 1.6);
                for (const double v : {c * x, s * x, 0.1, 0.0, -s * y, c * y, 0.0, 0.0, 0.2, 0.0, 1.1, 0.0,
                                       uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), 1.0})
                    n.f.push_back(float(v));
            }
            floats.insert(floats.end(), n.f.begin(), n.f.end());
            nodes.push_back(n);
        }
        for (int i = 0; i < 1 + pick(4); i++) {
            Node n;
            n.op = pick(8);
            const int count = n.op <= 3 ? 1 + pick(4) : n.op <= 5 ? 2 : 1;
            code.push_back(n.op);
            if (n.op <= 3)
                code.push_back(count);
            for (int k = 0; k < count; k++)
                n.of.push_back(pick(int(nodes.size())));
            code.insert(code.end(), n.of.begin(), n.of.end());
            if (n.op == 7) // names what it takes; no more
                n.op = 0;
            nodes.push_back(n);
        }
        // The last is the field.
        Node all;
        all.op = 0;
        all.of = {int(nodes.size()) - 1, 0};
        code.insert(code.end(), {0, 2, all.of[0], 0});
        nodes.push_back(all);
        blobby.code = code, blobby.floats = floats, blobby.leaves = m_leaves;
    }
    int leaves() const { return m_leaves; }
    double value(const double* p) const { return value(int(nodes.size()) - 1, p); }
    // By how much each leaf has a say, as the header has it; nothing where none has, or several might have
    // it.
    std::vector<double> say(const double* p) const {
        std::vector<double> by(size_t(m_leaves), 0.0);
        double sum = 0;
        if (!spread(int(nodes.size()) - 1, 1, p, by))
            return {};
        for (const double s : by)
            sum += s;
        if (sum == 0)
            return {};
        for (double& s : by)
            s /= sum;
        return by;
    }
    double uniform(double lo, double hi) { return lo + (hi - lo) * double(m_engine()) / 4294967296.0; }
    int pick(int n) { return int(m_engine() % unsigned(n)); }

  private:
    struct Node {
        int op = 0, leaf = -1;
        std::vector<float> f;
        std::vector<int> of;
    };
    double value(int i, const double* p) const {
        const Node& n = nodes[size_t(i)];
        if (n.op == 1000)
            return double(n.f[0]);
        if (n.op > 1000) {
            // p = q M for row vectors: q by Cramer's rule.
            const float* m = n.f.data() + (n.op == 1002 ? 7 : 0);
            const auto e = [&](int r, int c) { return double(m[4 * r + c]); };
            const auto det = [&](const double(&a)[3][3]) {
                return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                       a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                       a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
            };
            double whole[3][3], q[3];
            for (int r = 0; r < 3; r++)
                for (int c = 0; c < 3; c++)
                    whole[r][c] = e(r, c);
            for (int k = 0; k < 3; k++) {
                double with[3][3];
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 3; c++)
                        with[r][c] = r == k ? p[c] - e(3, c) : e(r, c);
                q[k] = det(with) / det(whole);
            }
            double radius = 1;
            if (n.op == 1002) { // from the nearest point of the segment, found by trying
                radius = double(n.f[6]);
                double best = 1e300, from[3];
                const auto at = [&](double t) {
                    double d = 0;
                    for (int c = 0; c < 3; c++) {
                        from[c] = q[c] - (double(n.f[size_t(c)]) * (1 - t) + double(n.f[size_t(3 + c)]) * t);
                        d += from[c] * from[c];
                    }
                    return d;
                };
                double lo = 0, hi = 1;
                for (int k = 0; k < 100; k++) { // convex: thirds
                    const double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
                    (at(a) < at(b) ? hi : lo) = at(a) < at(b) ? b : a;
                }
                best = at((lo + hi) / 2);
                const double r2 = best / (radius * radius);
                return r2 < 1 ? std::pow(1 - r2, 3) : 0;
            }
            const double r2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
            return r2 < 1 ? 1 - 3 * r2 + 3 * r2 * r2 - r2 * r2 * r2 : 0;
        }
        std::vector<double> v;
        for (const int k : n.of)
            v.push_back(value(k, p));
        double r = v[0];
        for (size_t k = 1; k < v.size(); k++)
            r = n.op == 0   ? r + v[k]
                : n.op == 1 ? r * v[k]
                : n.op == 2 ? std::max(r, v[k])
                : n.op == 3 ? std::min(r, v[k])
                            : r;
        if (n.op == 4) // the subtrahend comes first
            r = v[1] - v[0];
        if (n.op == 5)
            r = v[1] == 0 ? 0 : v[0] / v[1];
        if (n.op == 6)
            r = -v[0];
        return r;
    }
    bool spread(int i, double own, const double* p, std::vector<double>& by) const {
        const Node& n = nodes[size_t(i)];
        if (n.op >= 1000) {
            if (n.leaf >= 0)
                by[size_t(n.leaf)] += own;
            return true;
        }
        if (n.op >= 4)
            return spread(n.of[n.op == 4 ? 1 : 0], own, p, by);
        double sum = 0;
        int best = n.of[0], ties = 0;
        const auto better = [&](int a, int b) {
            return n.op == 2 ? value(a, p) > value(b, p) : value(a, p) < value(b, p);
        };
        for (const int k : n.of) {
            sum += std::max(0.0, value(k, p));
            best = better(k, best) ? k : best;
        }
        for (const int k : n.of)
            ties += k != best && value(k, p) == value(best, p);
        if (n.op >= 2)
            return ties == 0 && spread(best, own, p, by);
        bool clear = sum > 0;
        for (const int k : n.of)
            if (const double v = value(k, p); clear && v > 0)
                clear = spread(k, own * v / sum, p, by);
        return clear;
    }

    std::vector<Node> nodes;
    std::mt19937 m_engine;
    int m_leaves = 0;
};

} // namespace

TEST(BlobbyOracles, FieldsOfRandomPrograms) {
    int crossing = 0, empty = 0, smooth = 0, said = 0;
    for (uint32_t seed = 1; seed <= 300; seed++) {
        Program program(seed);
        SCOPED_TRACE("program " + std::to_string(seed));
        BlobbyField field;
        Journal journal;
        ASSERT_TRUE(field.prepare(program.blobby, {}, {}, journal));
        EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
        for (int box = 0; box < 8; box++) {
            double lo[3], hi[3];
            const double size = box % 2 ? 0.3 : 2;
            for (int c = 0; c < 3; c++)
                lo[c] = program.uniform(-2.5, 2), hi[c] = lo[c] + program.uniform(0.05, size);
            BlobbyField::Local outer, local;
            const double wide_lo[3] = {-3, -3, -3}, wide_hi[3] = {4, 4, 4};
            field.localize(wide_lo, wide_hi, nullptr, outer);
            field.localize(lo, hi, box % 3 ? &outer : nullptr, local);
            double least = 1e300, most = -1e300;
            for (int i = 0; i < 12; i++) {
                double p[3];
                for (int c = 0; c < 3; c++)
                    p[c] = program.uniform(lo[c], hi[c]);
                const double is = program.value(p), found = field.value(p, local);
                least = std::min(least, is), most = std::max(most, is);
                if (!(std::abs(is) < 1e6)) // divided by next to nothing
                    continue;
                ASSERT_NEAR(found, is, 1e-6 * (1 + std::abs(is)));
                ASSERT_EQ(found, field.value(p, outer)); // to the bit
                std::vector<double> by;
                field.influences(p, local, by);
                const std::vector<double> say = program.say(p);
                for (size_t k = 0; k < say.size(); k++, said++)
                    ASSERT_NEAR(by[k], say[k], 1e-6);
                // Where it is smooth, slopes to both sides agree.
                constexpr double H = 1e-4;
                const Dual d = field.dual(p, local);
                EXPECT_EQ(d.v, found);
                const double slopes[3] = {d.x, d.y, d.z};
                for (int c = 0; c < 3; c++) {
                    double a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
                    a[c] -= H, b[c] += H;
                    const double left = (is - program.value(a)) / H, right = (program.value(b) - is) / H;
                    if (!(std::abs(left - right) < 2e-3 * (1 + std::abs(left))))
                        continue;
                    EXPECT_NEAR(slopes[c], 0.5 * (left + right), 2e-3 * (1 + std::abs(left)));
                    smooth++;
                }
            }
            // What is found inside the box, the box knows of.
            if (least < BlobbyField::Surface && most > BlobbyField::Surface) {
                EXPECT_TRUE(local.crosses);
                crossing++;
            }
            empty += !local.crosses;
        }
    }
    EXPECT_GT(crossing, 80);
    EXPECT_GT(smooth, 20000);
    EXPECT_GT(said, 5000);
    EXPECT_GT(empty, 800); // bounds are of use
}

// A lone blob: of boxes that are small against it, those at its surface alone count.
TEST(BlobbyOracles, BoundsAreClose) {
    scene::Blobby blobby;
    blobby.code = std::vector<int32_t>{1001, 0, 1002, 16, 2, 2, 0, 1};
    blobby.floats = std::vector<float>{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, -1, 6, 0, 1,
                                       6, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,  0, 1};
    blobby.leaves = 2;
    BlobbyField field;
    Journal journal;
    ASSERT_TRUE(field.prepare(blobby, {}, {}, journal));
    ASSERT_EQ(field.supports().size(), 2u);
    for (int i = -40; i < 40; i++)
        for (int j = -40; j < 120; j++) {
            const double size = 0.1, lo[3] = {i * size, j * size, 0},
                         hi[3] = {lo[0] + size, lo[1] + size, size};
            BlobbyField::Local local;
            field.localize(lo, hi, nullptr, local);
            const double x = lo[0] + size / 2, y = lo[1] + size / 2, z = size / 2;
            // Distance from the surface: a ball of radius 1 and a capsule of radius 1/2 (halves of the
            // supports).
            const double ball = std::sqrt(x * x + y * y + z * z) - 1, rest = std::max(std::abs(x) - 1, 0.0),
                         capsule = std::sqrt(rest * rest + (y - 6) * (y - 6) + z * z) - 0.5;
            const double near = std::min(std::abs(ball), std::abs(capsule)), half = size * std::sqrt(3.0) / 2;
            const bool must = near < 0.02,
                       may = near < 2 * half; // lengths are bounded by sqrt(3) times theirs
            EXPECT_TRUE(local.crosses ? may : !must) << x << " " << y;
            for (const BlobbyField::Ball& b : field.supports())
                EXPECT_GE(b.radius * 0.5, 0.5);
        }
}

// 0.1 over what a ball of support 1 has above 0.3: its surface lies where that is 0.237, in a box where the
// divisor goes through zero. Far from the ball the quotient is -1/3, and nothing is there.
TEST(BlobbyOracles, BoundsOfQuotients) {
    scene::Blobby blobby;
    blobby.code = std::vector<int32_t>{1001, 0, 1000, 16, 1000, 17, 4, 1, 0, 5, 2, 3};
    blobby.floats = std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.3f, 0.1f};
    blobby.leaves = 1;
    BlobbyField field;
    Journal journal;
    ASSERT_TRUE(field.prepare(blobby, {}, {}, journal));
    const double lo[3] = {-1, -1, -1}, hi[3] = {1, 1, 1}, beside[3] = {4, -0.2, -0.2},
                 far[3] = {4.4, 0.2, 0.2};
    BlobbyField::Local local;
    field.localize(lo, hi, nullptr, local);
    EXPECT_TRUE(local.crosses);
    const double r = std::sqrt(1 - std::cbrt(0.3 + 0.1 / BlobbyField::Surface)), p[3] = {r, 0, 0};
    EXPECT_NEAR(field.value(p, local), BlobbyField::Surface, 1e-6);
    field.localize(beside, far, nullptr, local);
    EXPECT_FALSE(local.crosses);
}

// A placed ellipsoid, mirrored or its orientation reversed: vertices on the level of 0.42, where (1 - r^2)^3
// is that in the ball's own units; normals along the slope there, quads wound to the outside.
TEST(BlobbyOracles, PlacedBlobs) {
    const Transform turned = Transform::translate(3, -5, 2) * Transform::rotate(50, 1, -2, 0.5);
    Transform sheared = turned;
    sheared.m[0][1] += 0.7, sheared.m[2][0] -= 0.4;
    for (const bool reversed : {false, true})
        for (const Transform& m : {turned * Transform::scale(2, 2, 2), sheared * Transform::scale(1, 3, 0.8),
                                   sheared * Transform::scale(-1, 2, 1)}) {
            // Row vectors: q L + t lies at q of the unit ball.
            const float L[16] = {1.2f, 0.3f, 0, 0, -0.2f, 0.8f, 0.1f, 0, 0, 0.2f, 1, 0, 0.5f, -1, 2, 1};
            scene::Blobby blobby;
            blobby.code = std::vector<int32_t>{1001, 0};
            blobby.floats = std::vector<float>(L, L + 16);
            blobby.leaves = 1;
            scene::Primitive p;
            p.geometry = blobby;
            auto attributes = std::make_shared<scene::Attributes>();
            attributes->reverse_orientation = reversed;
            p.attributes = attributes;
            Eye eye;
            eye.pixels = 12;
            MeshParts out;
            Journal journal;
            ASSERT_TRUE(mesh_from_blobby(p, blobby, m, eye, journal, out));
            // Where the ball's axes and its middle are, and the rows that take them back.
            double axis[3][3], middle[3], back[3][3];
            for (size_t c = 0; c < 3; c++) {
                middle[c] = m.m[c][3];
                for (size_t k = 0; k < 3; k++) {
                    axis[k][c] = 0;
                    for (size_t e = 0; e < 3; e++)
                        axis[k][c] += m.m[c][e] * double(L[4 * k + e]);
                    middle[c] += m.m[c][k] * double(L[12 + k]);
                }
            }
            for (size_t k = 0; k < 3; k++) {
                const auto &a = axis[(k + 1) % 3], &b = axis[(k + 2) % 3];
                for (size_t c = 0; c < 3; c++)
                    back[k][c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
                const double det =
                    axis[k][0] * back[k][0] + axis[k][1] * back[k][1] + axis[k][2] * back[k][2];
                for (double& x : back[k])
                    x /= det;
            }
            const grid::Grid& g = out.vertices;
            const size_t n = size_t(g.stride);
            const double level = 0.25;
            int off = 0;
            for (size_t i = 0; i < size_t(g.vertices()); i++) {
                double r2 = 0, slope[3] = {}, along = 0, own = 0, l = 0;
                for (size_t k = 0; k < 3; k++) {
                    double q = 0;
                    for (size_t c = 0; c < 3; c++)
                        q += back[k][c] * (double(g.P[i + c * n]) - middle[c]);
                    r2 += q * q;
                    for (size_t c = 0; c < 3; c++)
                        slope[c] += q * back[k][c];
                }
                off += std::abs(r2 / level - 1) > 1e-4;
                EXPECT_NEAR(r2, level, 0.02); // where a cell holds Newton's steps up
                for (size_t c = 0; c < 3; c++) {
                    along += slope[c] * double(g.N[i + c * n]);
                    own += slope[c] * slope[c], l += double(g.N[i + c * n]) * double(g.N[i + c * n]);
                    EXPECT_EQ(g.N[i + c * n], g.Ng[i + c * n]);
                }
                EXPECT_NEAR(along / std::sqrt(own * l), reversed ? -1 : 1, 1e-5);
            }
            EXPECT_LT(off, g.vertices() / 20);
            double enclosed = 0; // of what is traced: outlines of facets are the ellipsoid's in the mean
            for (size_t f = 0; f < out.mesh.indices.size(); f += 4) {
                const auto q = [&](size_t k) { return g.position(int(out.mesh.indices[f + k])); };
                const Vec3f normal = at(g.N, out.mesh.indices[f], n);
                const Vec3f area = cross(q(2) - q(0), q(3) - q(1));
                EXPECT_GT(dot(area, normal) * (reversed ? -1.0f : 1.0f), 0);
                const auto traced = [&](size_t k) { return at(out.mesh.P, out.mesh.indices[f + k], n); };
                const Vec3f from{float(middle[0]), float(middle[1]), float(middle[2])};
                const Vec3f t = (traced(0) + traced(1) + traced(2) + traced(3)) * 0.25f - from;
                enclosed += double(dot(cross(traced(2) - traced(0), traced(3) - traced(1)), t)) / 6;
            }
            double det = 0;
            for (size_t c = 0; c < 3; c++)
                det += axis[0][c] * (axis[1][(c + 1) % 3] * axis[2][(c + 2) % 3] -
                                     axis[1][(c + 2) % 3] * axis[2][(c + 1) % 3]);
            const double ball = 4 / 3.0 * std::acos(-1.0) * std::pow(level, 1.5) * std::abs(det);
            EXPECT_NEAR(enclosed / ball, 1, 0.01);
        }
}

} // namespace kanuka::geom
