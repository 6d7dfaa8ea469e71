#include "render/page_frame.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "scene/bounds.h"

namespace kanuka::render {
namespace {

using Border = dice::DicingCamera::Border;

// Steps, over the distance: where the camera is taken to be is within 0.11 of the distance from where it is,
// and rates are off by as much. Powers of two change where round numbers do not lie.
constexpr double Loose = 0.1236;
// Over the size, for what depends on where exactly it is: far above what is left of digits after a move by
// 1e5.
constexpr double Fine = 1e-6;
constexpr double LooseTurn = 1.0 / 64;
// Edges of steps lie where round numbers do not.
constexpr double Phase = 0.38196601125;
// Positions are rounded to 2^-24 of their size. Where that is more than a sixteenth of a pixel, the page's
// origin goes to the camera.
constexpr double MostPixelsAcross = 1 << 20;

double floor_to_power(double x) {
    return x > 0 && std::isfinite(x) ? std::exp2(std::floor(std::log2(x))) : 0;
}

// Keys tell -0 from 0.
double positive_zero(double x) {
    return x + 0.0;
}

// The nearest of the points that are a step apart.
double in_steps(double x, double step) {
    return step > 0 && std::isfinite(x) ? positive_zero((std::round(x / step - Phase) + Phase) * step) : x;
}

struct Box {
    std::array<double, 3> lo{INFINITY, INFINITY, INFINITY}, hi{-INFINITY, -INFINITY, -INFINITY};
    bool empty() const { return !(lo[0] <= hi[0] && lo[1] <= hi[1] && lo[2] <= hi[2]); }
    void extend(const Vec3f& p) {
        for (size_t c = 0; c < 3; c++) {
            lo[c] = std::min(lo[c], double(p[int(c)]));
            hi[c] = std::max(hi[c], double(p[int(c)]));
        }
    }
    double distance(const std::array<double, 3>& p) const {
        double sum = 0;
        for (size_t c = 0; c < 3; c++) {
            const double d = std::max({lo[c] - p[c], p[c] - hi[c], 0.0});
            sum += d * d;
        }
        return std::sqrt(sum);
    }
    double radius() const { return 0.5 * std::hypot(hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]); }
    double farthest() const { // from the origin
        double sum = 0;
        for (size_t c = 0; c < 3; c++) {
            const double d = std::max(std::abs(lo[c]), std::abs(hi[c]));
            sum += d * d;
        }
        return std::sqrt(sum);
    }
};

Box box_of(const Transform& page_from_object, const Bounds3f& b) {
    Box box;
    if (!b.empty())
        for (int i = 0; i < 8; i++)
            box.extend(page_from_object.point(
                {i & 1 ? b.hi.x : b.lo.x, i & 2 ? b.hi.y : b.lo.y, i & 4 ? b.hi.z : b.lo.z}));
    return box;
}

std::array<double, 3> place_of(const Transform& t) {
    return {t.m[0][3], t.m[1][3], t.m[2][3]};
}

// No more than that an affine map makes lengths longer by it.
double most_stretch(const Transform& t) {
    double squares = 0, row = 0, column = 0;
    for (size_t i = 0; i < 3; i++) {
        double across = 0, down = 0;
        for (size_t k = 0; k < 3; k++) {
            across += std::abs(t.m[i][k]);
            down += std::abs(t.m[k][i]);
            squares += t.m[i][k] * t.m[i][k];
        }
        row = std::max(row, across);
        column = std::max(column, down);
    }
    return std::sqrt(std::min(squares, row * column));
}

// How near a mesh comes, at least, from within its box: face by face, by their boxes in object space. A face
// of a subdivision surface lies within its neighbours too, which are taken to be as large. 0 = not known.
double distance_of_faces(const scene::Primitive& primitive, const Transform& page_from_object,
                         const std::array<double, 3>& eye) {
    const scene::Value* P = primitive.primvars.find("P");
    const auto* polygons = std::get_if<scene::PolygonMesh>(&primitive.geometry);
    const auto* cage = std::get_if<scene::SubdivisionMesh>(&primitive.geometry);
    if (!P || (!polygons && !cage))
        return 0;
    Transform object_from_page;
    try {
        object_from_page = page_from_object.inverse();
    } catch (const Error&) {
        return 0;
    }
    const Vec3f e = object_from_page.point({float(eye[0]), float(eye[1]), float(eye[2])});
    const size_t points = P->floats.size() / 3;
    const float* p = P->floats.data();
    const scene::Buffer<int32_t>& vertices = polygons ? polygons->vertices : cage->vertices;
    const scene::Buffer<int32_t>& counts = polygons ? polygons->vertices_per_loop : cage->vertices_per_face;
    const size_t corners = vertices.empty() ? points : vertices.size();
    float nearest = INFINITY; // squared
    size_t at = 0;
    for (size_t face = 0; at < corners && (counts.empty() || face < counts.size()); face++) {
        const size_t count = counts.empty() ? 3 : size_t(std::max(counts[face], 0));
        Vec3f lo(INFINITY), hi(-INFINITY);
        for (size_t k = at; k < std::min(at + count, corners); k++) {
            const size_t v = vertices.empty() ? k : size_t(vertices[k]);
            if (v >= points)
                continue;
            for (int c = 0; c < 3; c++) {
                lo[c] = std::min(lo[c], p[3 * v + size_t(c)]);
                hi[c] = std::max(hi[c], p[3 * v + size_t(c)]);
            }
        }
        at += count;
        const float around = cage ? 0.5f * length(hi - lo) : 0;
        float squared = 0;
        for (int c = 0; c < 3; c++) {
            const float d = std::max({lo[c] - around - e[c], e[c] - hi[c] - around, 0.0f});
            squared += d * d;
        }
        nearest = std::min(nearest, squared);
    }
    return std::isfinite(nearest) ? double(std::sqrt(nearest)) / most_stretch(object_from_page) : 0;
}

// Of a box, as a camera sees it; see Density::perspective_at for what is outside, and by how much. Both
// conditions hold all over the box if they hold at its corners: one side is linear, the other convex.
Border border_of(const Box& box, const Transform& page_from_camera, const dice::DicingCamera& camera) {
    if (camera.projection == Projection::Spherical)
        return Border::Within;
    if (camera.projection != Projection::Perspective || box.empty() || !(camera.pixels_per_tangent > 0))
        return Border::Across;
    constexpr double Coarsest = 0.2; // beyond it, all is as coarse as it gets
    Transform camera_from_page;
    try {
        camera_from_page = page_from_camera.inverse();
    } catch (const Error&) {
        return Border::Across;
    }
    const auto& m = camera_from_page.m;
    const double stretch = double(camera.pixel_stretch), across = double(camera.pixels_per_tangent);
    const double middle[2] = {double(camera.middle_x), double(camera.middle_y) * stretch};
    const double half[2] = {0.5 * camera.width / across, 0.5 * camera.height / across};
    bool within = true;
    std::array<bool, 4> beyond{true, true, true, true}; // a side of the picture
    for (int corner = 0; corner < 8; corner++) {
        std::array<double, 3> q{};
        for (size_t r = 0; r < 3; r++) {
            q[r] = m[r][3];
            for (size_t c = 0; c < 3; c++)
                q[r] += m[r][c] * (corner >> c & 1 ? box.hi[c] : box.lo[c]);
        }
        q[1] *= stretch;
        const double farthest = Coarsest * std::hypot(q[0], q[1], q[2]);
        for (size_t side = 0; side < 4; side++) {
            const double x = q[side / 2] - middle[side / 2] * q[2];
            const double past = (side % 2 ? x : -x) - half[side / 2] * q[2];
            within &= past < 0;
            beyond[side] &= past > farthest;
        }
    }
    if (within)
        return Border::Within;
    return std::ranges::any_of(beyond, std::identity()) ? Border::Outside : Border::Across;
}

// Turned and placed by steps.
Transform in_steps(const Transform& page_from_camera, double step, double turn) {
    Transform t = page_from_camera;
    const double scale = double(float(std::cbrt(std::abs(t.determinant3()))));
    for (size_t r = 0; r < 3; r++) {
        if (scale > 0 && std::isfinite(scale))
            for (size_t c = 0; c < 3; c++)
                t.m[r][c] = positive_zero(std::round(t.m[r][c] / (scale * turn)) * turn * scale);
        t.m[r][3] = in_steps(t.m[r][3], step);
    }
    return t;
}

bool is_affine(const Transform& t) {
    return t.m[3] == std::array<double, 4>{0, 0, 0, 1};
}

class Framing {
  public:
    Framing(const scene::Primitive& rest, const Transform& parent_from_group, const GroupView* instanced,
            const dice::DicingCamera& camera, std::span<const Transform> while_moving)
        : m_rest(rest), m_camera(camera), m_moves(!while_moving.empty()), m_instanced(instanced != nullptr) {
        const Transform& group_from_object = rest.world_from_object;
        m_out.page_from_object = group_from_object;
        if (is_affine(group_from_object)) {
            m_origin = place_of(group_from_object);
            for (size_t c = 0; c < 3; c++) {
                m_out.page_from_object.m[c][3] = 0;
                m_out.offset[c] = m_origin[c] + parent_from_group.m[c][3];
            }
        } else
            m_out.offset = place_of(parent_from_group);
        m_box = box_of(m_out.page_from_object, scene::object_bounds(rest));
        if (!instanced && !camera.shot.empty() && !m_moves && !turns_to_camera()) {
            for (const Transform& t : camera.shot)
                add(t);
        } else if (!instanced) {
            add(camera.page_from_camera);
            for (const Transform& t : camera.also_from)
                add(t);
        } else {
            m_out.pixels_per_unit = std::exp2(std::round(4 * std::log2(instanced->pixels_per_unit)) / 4);
            for (const Transform& t : instanced->cameras)
                add(t);
        }
        if (!m_out.cameras.empty())
            for (const Transform& t : while_moving)
                add(t);
        if (m_out.cameras.empty())
            frame_unseen();
        else
            frame_seen();
        m_out.page_from_world = Transform::translate(-m_origin[0], -m_origin[1], -m_origin[2]);
    }

    PageFrame take() { return std::move(m_out); }

  private:
    void add(const Transform& parent_from_camera) {
        const auto& o = m_out.offset;
        m_out.cameras.push_back(Transform::translate(-o[0], -o[1], -o[2]) * parent_from_camera);
    }

    // From everywhere: what is modelled far from its origin is built around its middle.
    void frame_unseen() {
        if (m_box.empty() || !(m_box.farthest() * double(m_out.pixels_per_unit) > MostPixelsAcross))
            return;
        const double step = 4 * floor_to_power(m_box.radius());
        std::array<double, 3> middle;
        for (size_t c = 0; c < 3; c++)
            middle[c] = step > 0 ? std::round(0.5 * (m_box.lo[c] + m_box.hi[c]) / step) * step : m_box.lo[c];
        move_origin(middle);
    }

    void frame_seen() {
        double pixels = 0; // a unit, at most
        bool loose = !m_moves && !turns_to_camera() && !m_box.empty();
        std::vector<double> distances;
        for (const Transform& t : m_out.cameras) {
            const std::array<double, 3> eye = place_of(t);
            double distance = m_box.empty() ? 0 : m_box.distance(eye);
            if (distance == 0 && !m_box.empty())
                distance = distance_of_faces(m_rest, m_out.page_from_object, eye);
            distances.push_back(distance);
            const bool parallel = m_camera.projection == Projection::Orthographic;
            const double here = double(m_camera.finest_pixels()) /
                                (parallel ? 1 : std::max({distance, double(m_camera.near_clip), 1e-6})) /
                                std::max(std::cbrt(std::abs(t.determinant3())), 1e-30);
            pixels = std::max(pixels, here);
            loose &= distance > 0;
        }
        m_out.border = border_of(m_box, m_out.cameras[0], m_camera);
        for (const Transform& t : m_out.cameras)
            if (border_of(m_box, t, m_camera) != m_out.border)
                m_out.border = Border::Across;
        loose &= m_out.border != Border::Across;
        for (size_t i = 0; i < m_out.cameras.size(); i++) {
            Transform& t = m_out.cameras[i];
            const std::array<double, 3> eye = place_of(t);
            const double size =
                std::max(m_box.empty() ? 0 : m_box.farthest(), std::hypot(eye[0], eye[1], eye[2]));
            t = in_steps(t, floor_to_power(loose ? distances[i] * Loose : size * Fine),
                         loose ? LooseTurn : Fine);
        }
        if (!m_box.empty() && m_box.farthest() * pixels > MostPixelsAcross)
            move_origin(place_of(m_out.cameras[0]));
    }

    // Flat curves and disks.
    bool turns_to_camera() const {
        return !m_instanced && (std::holds_alternative<scene::Curves>(m_rest.geometry) ||
                                std::holds_alternative<scene::Points>(m_rest.geometry));
    }

    void move_origin(const std::array<double, 3>& to) {
        if (!is_affine(m_out.page_from_object))
            return;
        for (size_t c = 0; c < 3; c++) {
            m_origin[c] += to[c];
            m_out.offset[c] += to[c];
            m_out.page_from_object.m[c][3] -= to[c];
            for (Transform& t : m_out.cameras)
                t.m[c][3] -= to[c];
        }
    }

    const scene::Primitive& m_rest;
    const dice::DicingCamera& m_camera;
    const bool m_moves, m_instanced;
    Box m_box;                        // in the page's space, while its origin is that of object space
    std::array<double, 3> m_origin{}; // of the page's, in the group's or the world's space
    PageFrame m_out;
};

} // namespace

PageFrame page_frame(const scene::Primitive& rest, const Transform& parent_from_group,
                     const GroupView* instanced, const dice::DicingCamera& camera,
                     std::span<const Transform> while_moving) {
    return Framing(rest, parent_from_group, instanced, camera, while_moving).take();
}

} // namespace kanuka::render
