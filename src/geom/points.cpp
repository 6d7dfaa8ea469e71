// Points to balls, spheres of triangles, disks and squares; or to blobs. Small spheres are balls, one vertex
// each, which the ray tracer rounds; large ones show what varies across them.
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
constexpr float Wide = 2;           // micropolygon edges: wider spheres are surfaces, as curves are
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

// The shapes of all points as one mesh.
class PointsMesher {
  public:
    // `normals`: null = shapes face the camera. `first`: decides the refinement.
    PointsMesher(const scene::Primitive& primitive, ControlPoints points, const Transform& m,
                 const Viewpoint& view, const Primvars& primvars, const Primvar* normals, Kind kind,
                 bool polygons, const scene::Primitive* first)
        : m_view(view), m_primvars(primvars), m_normals(normals), m_kind(kind), m_polygons(polygons),
          // What faces the camera has none to face where it is instanced.
          m_flat((kind == Kind::Disk || kind == Kind::Square) && (normals || view.has_camera())),
          m_points(std::move(points)), m_first_points(first ? control_points(*first, m) : ControlPoints{}),
          m_sized(first ? m_first_points : m_points), m_widths(primitive, m),
          m_first_widths(first ? *first : primitive, m), m_aspect(primitive, "patchaspectratio", 1),
          m_angle(primitive, "patchangle", 0) {}
    PointsMesher(const PointsMesher&) = delete;
    PointsMesher& operator=(const PointsMesher&) = delete;

    // False: nothing is left.
    bool choose_levels(const Location& where, Journal& journal) {
        const size_t n = m_points.size();
        size_levels(where, journal);
        if (m_balls_only)
            return number_balls();
        m_first_vertex.assign(n + 1, 0);
        m_first_index.assign(n + 1, 0);
        int finest = Levels - 1;
        for (;; finest--) { // all are coarser where they would be too many
            for (size_t i = 0; i < n; i++) {
                const int8_t level = m_level[i] = std::min(m_level[i], int8_t(finest));
                m_first_vertex[i + 1] =
                    m_first_vertex[i] + (level < 0 ? 0 : ball_of(level).directions.size());
                m_first_index[i + 1] = m_first_index[i] + (level < 0 ? 0 : ball_of(level).triangles.size());
            }
            if (finest == 0 || double(m_first_vertex[n]) <= m_view.most_vertices())
                break;
        }
        if (finest < Levels - 1)
            journal.warning(where, "points would need more vertices than " +
                                       std::to_string(int64_t(m_view.most_vertices())) +
                                       "; they were made of fewer each");
        return m_first_index[n] > 0;
    }

    void fill(MeshParts& out) const {
        const size_t n = m_points.size();
        allocate_mesh(out, m_first_vertex[n], m_primvars);
        if (m_balls_only)
            return fill_balls(out);
        out.mesh.indices.resize(m_first_index[n]);
        out.mesh.around = m_kind == Kind::Sphere; // one layer, as a ball
        tasks::parallel_chunks(n, 1024, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                if (m_level[i] >= 0)
                    add(i, out);
        });
    }

  private:
    struct Axes {
        Vec3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    };

    // Level of every point by its size in the picture; -1 = left out.
    void size_levels(const Location& where, Journal& journal) {
        const size_t n = m_points.size();
        const float finer = std::max(1.0f, UsualChord / m_view.chord_pixels());
        const bool own_widths = has_widths(m_first_widths);
        Dropped dropped;
        size_t wide = 0, all = 0;
        m_level.assign(n, -1);
        for (size_t i = 0; i < n; i++) {
            const float radius = 0.5f * m_first_widths.at(own_widths ? i : 0);
            if (i >= m_sized.size() || !m_sized.finite(i) || !std::isfinite(radius))
                dropped.non_finite++;
            else if (radius > 0) {
                const float pixels = finer * radius * m_view.pixels_per_unit(m_sized[i]);
                m_level[i] = int8_t(
                    std::find_if(LevelRadius, LevelRadius + Levels - 1, [&](float r) { return pixels < r; }) -
                    LevelRadius);
                const Vec3f across = side_of(m_view.towards_camera(m_sized[i])) * (2 * radius);
                wide += m_view.cells(m_sized[i], m_sized[i] + across) >= Wide, all++;
            }
        }
        dropped.report(n, "points", where, journal);
        m_balls_only = m_kind == Kind::Sphere && !m_polygons && 2 * wide <= all;
    }
    static Vec3f side_of(const Vec3f& towards) {
        return normalize(cross(towards, abs(towards.x) < abs(towards.y) ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0)));
    }

    bool number_balls() {
        const size_t n = m_points.size();
        m_first_vertex.assign(n + 1, 0);
        for (size_t i = 0; i < n; i++)
            m_first_vertex[i + 1] = m_first_vertex[i] + (m_level[i] < 0 ? 0 : 1);
        return m_first_vertex[n] > 0;
    }
    // Shaders see the middle of the side that faces the camera, as of fibres.
    void fill_balls(MeshParts& out) const {
        const size_t n = m_points.size(), count = m_first_vertex[n];
        out.mesh.vertices_per_face = 1;
        out.mesh.balls = out.mesh.around = true;
        out.mesh.indices.resize(count);
        out.mesh.radius.resize(count);
        tasks::parallel_chunks(n, 1024, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++)
                if (m_level[i] >= 0)
                    add_ball(i, out);
        });
    }
    void add_ball(size_t i, MeshParts& out) const {
        grid::Grid& g = out.vertices;
        const size_t v = m_first_vertex[i];
        const float radius = 0.5f * m_widths.at(has_widths(m_widths) ? i : 0);
        const Vec3f center = m_points.finite(i) ? m_points[i] : m_sized[i];
        const Vec3f towards = m_view.has_camera() ? m_view.towards_camera(center) : Vec3f(0, 0, 1),
                    side = side_of(towards), up = cross(towards, side);
        out.mesh.indices[v] = uint32_t(v);
        out.mesh.radius[v] = std::isfinite(radius) ? std::max(radius, 0.0f) : 0;
        for (int c = 0; c < 3; c++) {
            const size_t at = v + size_t(c) * g.stride;
            g.P[at] = center[c];
            g.N[at] = g.Ng[at] = towards[c];
            g.dPdu[at] = side[c] * (2 * radius), g.dPdv[at] = up[c] * (2 * radius);
        }
        fill_primvars(i, v, g);
    }
    void fill_primvars(size_t i, size_t v, grid::Grid& g) const {
        for (const Primvar& primvar : m_primvars.list)
            for (int c = 0; c < primvar.components; c++)
                primvar.destination(g, c)[v] = primvar(primvar.detail == scene::Detail::Uniform ? 0 : i, c);
    }

    bool has_widths(const Widths& widths) const {
        return widths.varying() && widths.varying()->floats.size() >= m_points.size();
    }

    const Ball& ball_of(int8_t level) {
        Ball& ball = m_balls[size_t(level)];
        if (ball.directions.empty())
            ball = !m_flat ? make_ball(level) : m_kind == Kind::Disk ? make_disk(level) : make_square();
        return ball;
    }

    // Of a flat shape: z is its normal.
    Axes axes_of(size_t i, const Vec3f& center) const {
        Axes a;
        a.z = m_view.towards_camera(center);
        if (m_normals) {
            const size_t item = m_normals->detail == scene::Detail::Uniform ? 0 : i;
            a.z = {(*m_normals)(item, 0), (*m_normals)(item, 1), (*m_normals)(item, 2)};
        }
        a.z = length_squared(a.z) > 0 ? normalize(a.z) : Vec3f{0, 0, 1};
        // Upright in the picture, as far as that goes.
        const Vec3f up = std::abs(a.z.y) < 0.999f ? Vec3f{0, 1, 0} : Vec3f{1, 0, 0};
        a.x = normalize(cross(up, a.z));
        a.y = cross(a.z, a.x);
        if (m_kind == Kind::Square) {
            const float angle = m_angle.at(i) * (Pi / 180);
            const Vec3f turned = a.x * std::cos(angle) + a.y * std::sin(angle);
            a.y = (a.y * std::cos(angle) - a.x * std::sin(angle)) * (1 / std::max(m_aspect.at(i), 1e-6f));
            a.x = turned;
        }
        return a;
    }

    void add(size_t i, MeshParts& out) const {
        grid::Grid& g = out.vertices;
        const int8_t level = m_level[i];
        const Ball& ball = m_balls[size_t(level)];
        const float radius = 0.5f * m_widths.at(has_widths(m_widths) ? i : 0) * ball.scale;
        const Vec3f center = m_points.finite(i) ? m_points[i] : m_sized[i];
        const Axes axes = m_flat ? axes_of(i, center) : Axes();
        for (size_t k = 0; k < ball.directions.size(); k++) {
            const size_t v = m_first_vertex[i] + k;
            const Vec3f d = ball.directions[k];
            const Vec3f p = m_flat ? axes.x * d.x + axes.y * d.y : d, n = m_flat ? axes.z : d;
            for (int c = 0; c < 3; c++) {
                const size_t at = v + size_t(c) * g.stride;
                g.P[at] = center[c] + p[c] * radius;
                g.N[at] = g.Ng[at] = n[c];
            }
            if (m_flat) {
                g.u[v] = g.s[v] = 0.5f + 0.5f * d.x;
                g.v[v] = g.t[v] = 0.5f - 0.5f * d.y; // from the top, as pictures are
            }
            fill_primvars(i, v, g);
        }
        for (size_t k = 0; k < ball.triangles.size(); k++)
            out.mesh.indices[m_first_index[i] + k] = uint32_t(m_first_vertex[i] + ball.triangles[k]);
    }

    const Viewpoint& m_view;
    const Primvars& m_primvars;
    const Primvar* m_normals;
    const Kind m_kind;
    const bool m_polygons;
    bool m_balls_only = false;
    const bool m_flat;
    const ControlPoints m_points, m_first_points;
    const ControlPoints& m_sized; // what decides the refinement
    const Widths m_widths, m_first_widths;
    const PerPoint m_aspect, m_angle;
    std::vector<int8_t> m_level;
    std::vector<size_t> m_first_vertex, m_first_index;
    std::array<Ball, Levels> m_balls; // those that are used
};

} // namespace

bool mesh_from_points(const scene::Primitive& primitive, const Transform& m, const Viewpoint& view,
                      bool polygons, Journal& journal, MeshParts& out, const scene::Primitive* first) {
    ControlPoints points = control_points(primitive, m);
    const size_t n = points.size();
    const Primvars primvars = collect_primvars(primitive, m, {1, n, n, n}, journal);
    const Primvar* normals = primvars.find("N");
    normals = normals ? normals : primvars.find("Np");
    if (normals && normals->components != 3)
        normals = nullptr;
    const Kind kind = kind_of(primitive, normals, journal);
    if (kind == Kind::Blobs)
        return mesh_from_blobs(primitive, m, view, journal, out, first);
    PointsMesher mesher(primitive, std::move(points), m, view, primvars, normals, kind, polygons, first);
    if (!mesher.choose_levels(primitive.where, journal))
        return false;
    mesher.fill(out);
    return true;
}

} // namespace kanuka::geom
