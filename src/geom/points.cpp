// Points to small spheres, disks and squares; or to blobs.
#include <map>

#include "base/tasks.h"
#include "geom/traced_mesh.h"

namespace kanuka::geom {
namespace {

constexpr int Levels = 7;
// A level serves spheres of less than this radius in pixels: its outline is an eighth of one off the circle
// on the mean, from where that is most, half of what chords may be off by. (Of a ball of radius one the
// outlines of the levels are off by 0.144, 0.0511, 0.0136, 0.00316, 0.000756 and 0.000164.)
constexpr float LevelRadius[Levels] = {0.85f, 2.4f, 9, 39, 160, 750, 1e30f};
constexpr float UsualChord = 0.25f; // pixels; where chords may be off by less, spheres count as larger

struct Ball {
    bool flat = false; // directions lie in x and y, and z is the normal
    std::vector<Vec3f> directions;
    std::vector<uint32_t> triangles;
    float scale =
        1; // makes the mean silhouette that of the sphere: a quarter of a convex body's surface (Cauchy)
};

// An octahedron, every triangle cut in four `level` times.
Ball make_ball(int level) {
    Ball b;
    b.directions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    b.triangles = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    for (int l = 0; l < level; l++) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t i, uint32_t j) {
            const auto [at, fresh] =
                middles.try_emplace({std::min(i, j), std::max(i, j)}, uint32_t(b.directions.size()));
            if (fresh)
                b.directions.push_back(normalize(b.directions[i] + b.directions[j]));
            return at->second;
        };
        std::vector<uint32_t> next;
        for (size_t t = 0; t < b.triangles.size(); t += 3) {
            const uint32_t i = b.triangles[t], j = b.triangles[t + 1], k = b.triangles[t + 2];
            const uint32_t ij = middle(i, j), jk = middle(j, k), ki = middle(k, i);
            for (const uint32_t v : {i, ij, ki, ij, j, jk, ki, jk, k, ij, jk, ki})
                next.push_back(v);
        }
        b.triangles = std::move(next);
    }
    float area = 0;
    for (size_t t = 0; t < b.triangles.size(); t += 3) {
        const Vec3f &p = b.directions[b.triangles[t]], &q = b.directions[b.triangles[t + 1]],
                    &r = b.directions[b.triangles[t + 2]];
        area += 0.5f * length(cross(q - p, r - p));
    }
    b.scale = std::sqrt(4 * Pi / area);
    return b;
}

// A regular polygon of the disk's area, as a fan.
Ball make_disk(int level) {
    constexpr int Corners[Levels] = {6, 10, 16, 32, 64, 128, 256};
    Ball b;
    b.flat = true;
    const int n = Corners[level];
    b.directions.push_back({0, 0, 0});
    for (int i = 0; i < n; i++) {
        const float a = 2 * Pi * float(i) / float(n);
        b.directions.push_back({std::cos(a), std::sin(a), 0});
        for (const int k : {0, 1 + i, 1 + (i + 1) % n})
            b.triangles.push_back(uint32_t(k));
    }
    b.scale = std::sqrt(Pi / (0.5f * float(n) * std::sin(2 * Pi / float(n))));
    return b;
}

Ball make_square() {
    Ball b;
    b.flat = true;
    b.directions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    b.triangles = {0, 1, 2, 0, 2, 3};
    return b;
}

// What "type" says. Without it, points that have normals are disks across them.
enum class Kind { Sphere, Disk, Square, Blobs };
Kind kind_of(const scene::Primitive& primitive, bool normals, Journal& journal) {
    const std::string type = primitive.primvars.get_string("type", "");
    if (type == "disk" || type == "disc" || (normals && (type.empty() || type == "particle")))
        return Kind::Disk;
    if (type == "patch")
        return Kind::Square;
    if (type == "blobby")
        return Kind::Blobs;
    if (!type.empty() && type != "sphere" && type != "particle")
        journal.error(primitive.where, "Points of the type \"" + type +
                                           "\" are rendered as spheres; there are particle, sphere, disk, "
                                           "patch and blobby");
    return Kind::Sphere;
}

// A value for every point, or one for all.
class PerPoint {
  public:
    PerPoint(const scene::Primitive& primitive, const char* name, float otherwise)
        : m_value(primitive.primvars.find(name)), m_otherwise(otherwise) {
        if (m_value && m_value->floats.empty())
            m_value = nullptr;
    }
    float at(size_t i) const {
        return !m_value ? m_otherwise : m_value->floats[i < m_value->floats.size() ? i : 0];
    }

  private:
    const scene::Value* m_value;
    float m_otherwise;
};

// Blobs whose lone surface has the points' widths.
bool mesh_from_blobs(const scene::Primitive& primitive, const Transform& m, const Viewpoint& view,
                     Journal& journal, MeshParts& out, const scene::Primitive* first) {
    const scene::Value* p = primitive.primvars.find("P");
    if (!p)
        return false;
    const PerPoint width(primitive, primitive.primvars.find("width") ? "width" : "constantwidth", 1);
    scene::Blobby blobby;
    std::vector<int32_t> code;
    std::vector<float> floats;
    const size_t n = p->floats.size() / 3;
    for (size_t i = 0; i < n; i++) {
        code.insert(code.end(), {1001, int32_t(floats.size())});
        const float w = width.at(i);
        const float* q = p->floats.data() + 3 * i;
        floats.insert(floats.end(), {w, 0, 0, 0, 0, w, 0, 0, 0, 0, w, 0, q[0], q[1], q[2], 1});
    }
    code.insert(code.end(), {0, int32_t(n)});
    for (size_t i = 0; i < n; i++)
        code.push_back(int32_t(i));
    blobby.leaves = int(n);
    blobby.code = std::move(code);
    blobby.floats = std::move(floats);
    return mesh_from_blobby(primitive, blobby, m, view, journal, out, first);
}

} // namespace

bool mesh_from_points(const scene::Primitive& primitive, const Transform& m, const Viewpoint& view,
                      Journal& journal, MeshParts& out, const scene::Primitive* first) {
    const ControlPoints points = control_points(primitive, m);
    const Widths widths(primitive, m);
    const ControlPoints first_points = first ? control_points(*first, m) : ControlPoints{};
    const Widths first_widths(first ? *first : primitive, m);
    const ControlPoints& sized = first ? first_points : points; // what decides the refinement
    const float finer = std::max(1.0f, UsualChord / view.chord_pixels());
    const size_t n = points.size();
    const Primvars primvars = collect_primvars(primitive, m, {1, n, n, n}, journal);
    const bool own_widths = widths.varying() && widths.varying()->floats.size() >= n;
    const Primvar* normals = primvars.find("N");
    normals = normals ? normals : primvars.find("Np");
    if (normals && normals->components != 3)
        normals = nullptr;
    const Kind kind = kind_of(primitive, normals, journal);
    if (kind == Kind::Blobs)
        return mesh_from_blobs(primitive, m, view, journal, out, first);
    // What faces the camera has none to face where it is instanced.
    const bool flat = (kind == Kind::Disk || kind == Kind::Square) && (normals || view.has_camera());
    const PerPoint aspect(primitive, "patchaspectratio", 1), angle(primitive, "patchangle", 0);

    // Level of every point; -1 = left out. All are coarser where they would be too many.
    std::vector<int8_t> level(n);
    int finest = Levels - 1;
    Dropped dropped;
    std::vector<size_t> first_vertex(n + 1, 0), first_index(n + 1, 0);
    const bool own_first_widths = first_widths.varying() && first_widths.varying()->floats.size() >= n;
    for (size_t i = 0; i < n; i++) {
        const float radius = 0.5f * first_widths.at(own_first_widths ? i : 0);
        level[i] = -1;
        if (i >= sized.size() || !sized.finite(i) || !std::isfinite(radius))
            dropped.non_finite++;
        else if (radius > 0) {
            const float pixels = finer * radius * view.pixels_per_unit(sized[i]);
            level[i] = int8_t(
                std::find_if(LevelRadius, LevelRadius + Levels - 1, [&](float r) { return pixels < r; }) -
                LevelRadius);
        }
    }
    dropped.report(n, "points", primitive.where, journal);
    std::array<Ball, Levels> balls; // those that are used
    const auto ball_of = [&](int8_t l) -> const Ball& {
        Ball& ball = balls[size_t(l)];
        if (ball.directions.empty())
            ball = !flat ? make_ball(l) : kind == Kind::Disk ? make_disk(l) : make_square();
        return ball;
    };
    for (;; finest--) {
        for (size_t i = 0; i < n; i++) {
            level[i] = std::min(level[i], int8_t(finest));
            first_vertex[i + 1] = first_vertex[i] + (level[i] < 0 ? 0 : ball_of(level[i]).directions.size());
            first_index[i + 1] = first_index[i] + (level[i] < 0 ? 0 : ball_of(level[i]).triangles.size());
        }
        if (finest == 0 || double(first_vertex[n]) <= view.most_vertices())
            break;
    }
    if (finest < Levels - 1)
        journal.warning(primitive.where, "points would need more vertices than " +
                                             std::to_string(int64_t(view.most_vertices())) +
                                             "; they were made of fewer each");
    if (first_index[n] == 0)
        return false;
    allocate_mesh(out, first_vertex[n], primvars);
    out.mesh.indices.resize(first_index[n]);
    grid::Grid& g = out.vertices;
    tasks::parallel_chunks(n, 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            if (level[i] < 0)
                continue;
            const Ball& ball = balls[level[i]];
            const float radius = 0.5f * widths.at(own_widths ? i : 0) * ball.scale;
            const Vec3f center = points.finite(i) ? points[i] : sized[i];
            Vec3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
            if (flat) {
                z = view.towards_camera(center);
                if (normals) {
                    const size_t item = normals->detail == scene::Detail::Uniform ? 0 : i;
                    z = {(*normals)(item, 0), (*normals)(item, 1), (*normals)(item, 2)};
                }
                z = length_squared(z) > 0 ? normalize(z) : Vec3f{0, 0, 1};
                // Upright in the picture, as far as that goes.
                const Vec3f up = std::abs(z.y) < 0.999f ? Vec3f{0, 1, 0} : Vec3f{1, 0, 0};
                x = normalize(cross(up, z));
                y = cross(z, x);
                if (kind == Kind::Square) {
                    const float a = angle.at(i) * (Pi / 180);
                    const Vec3f turned = x * std::cos(a) + y * std::sin(a);
                    y = (y * std::cos(a) - x * std::sin(a)) * (1 / std::max(aspect.at(i), 1e-6f));
                    x = turned;
                }
            }
            for (size_t k = 0; k < ball.directions.size(); k++) {
                const size_t v = first_vertex[i] + k;
                const Vec3f d = ball.directions[k];
                const Vec3f p = flat ? x * d.x + y * d.y : d, n = flat ? z : d;
                for (int c = 0; c < 3; c++) {
                    const size_t at = v + size_t(c) * g.stride;
                    g.P[at] = center[c] + p[c] * radius;
                    g.N[at] = g.Ng[at] = n[c];
                }
                if (flat) {
                    g.u[v] = g.s[v] = 0.5f + 0.5f * d.x;
                    g.v[v] = g.t[v] = 0.5f - 0.5f * d.y; // from the top, as pictures are
                }
                for (const Primvar& p : primvars.list)
                    for (int c = 0; c < p.components; c++)
                        p.destination(g, c)[v] = p(p.detail == scene::Detail::Uniform ? 0 : i, c);
            }
            for (size_t k = 0; k < ball.triangles.size(); k++)
                out.mesh.indices[first_index[i] + k] = uint32_t(first_vertex[i] + ball.triangles[k]);
        }
    });
    return true;
}

} // namespace kanuka::geom
