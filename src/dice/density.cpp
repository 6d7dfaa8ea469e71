#include "dice/density.h"

#include <cmath>

namespace kanuka::dice {

// Surfaces seen edge on are not diced coarser than this: displacement, reflections and silhouettes show them.
constexpr float LeastForeshortening = 1.0f / 8;
// Out of the picture edges grow to nine times their length, within some eleven degrees of its border: what
// rays find there is seen in reflections and by its light alone.
constexpr float OffscreenGrowth = 8, OffscreenSlope = 5;
constexpr float Worthwhile = 4; // cells: lines of fewer are not cut for being uneven

Density::Density(const DiceTarget& target, const DiceOptions& options, float shading_rate)
    : m_field(target.field) {
    if (m_field)
        try {
            m_object_from_page = target.page_from_object.inverse();
        } catch (const Error&) {
            m_field = nullptr; // flattened
        }
    const DicingCamera& camera = options.camera;
    const float rate = std::max(1e-4f, shading_rate * options.shading_rate_scale);
    m_most = options.max_micropolygons;
    m_cells_per_pixel = std::max(target.finer, 1.0f) / std::sqrt(rate);
    m_uniform = target.pixels_per_unit;
    if (options.geometry_tolerance > 0)
        m_chord_pixels = options.geometry_tolerance;
    m_projection = camera.projection;
    m_half_angle = camera.half_angle;
    m_by_place = camera.border == DicingCamera::Border::Across ? 1.0f : 0.0f;
    m_everywhere = camera.border == DicingCamera::Border::Outside ? 1.0f : 0.0f;
    m_pixels_per_tangent = camera.pixels_per_tangent > 0 ? camera.pixels_per_tangent : 1;
    m_near = std::max(camera.near_clip, 1e-6f);
    m_falloff = std::max(0.0f, camera.offscreen_falloff) * OffscreenGrowth;
    m_half_width = 0.5f * float(camera.width) / m_pixels_per_tangent;
    m_half_height = 0.5f * float(camera.height) / m_pixels_per_tangent;
    m_stretch = camera.pixel_stretch > 0 ? camera.pixel_stretch : 1;
    m_middle_x = camera.middle_x, m_middle_y = camera.middle_y * m_stretch;
    const float far_x = std::abs(m_middle_x) + m_half_width, far_y = std::abs(m_middle_y) + m_half_height;
    m_edge_cosine = 1 / std::sqrt(1 + far_x * far_x + far_y * far_y);
    m_instanced = m_uniform > 0 || !target.instead_from.empty();
    for (const Transform& pose : target.instead_from)
        add_pose(pose);
    if (target.instead_from.empty()) {
        add_pose(camera.page_from_camera);
        for (const Transform& pose : camera.also_from)
            add_pose(pose);
    }
    for (const Transform& pose : target.also_from)
        add_pose(pose);
}

void Density::add_pose(const Transform& page_from_camera) {
    Transform inverse;
    try {
        inverse = page_from_camera.inverse();
    } catch (const Error&) {
        m_uniform = m_uniform > 0 ? m_uniform : 1; // a camera that sees nothing
    }
    Pose pose;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            pose.camera_from_page[i][j] = float(inverse.m[i][j] * (i == 1 ? m_stretch : 1));
    pose.scale = float(std::cbrt(std::abs(inverse.determinant3())));
    pose.eye = page_from_camera.point({0, 0, 0});
    pose.view = page_from_camera.vector({0, 0, 1});
    m_poses.push_back(pose);
}

inline Vec3f Density::Pose::to_camera(const Vec3f& p) const {
    const auto& m = camera_from_page;
    return {fma(m[0][0], p.x, fma(m[0][1], p.y, fma(m[0][2], p.z, m[0][3]))),
            fma(m[1][0], p.x, fma(m[1][1], p.y, fma(m[1][2], p.z, m[1][3]))),
            fma(m[2][0], p.x, fma(m[2][1], p.y, fma(m[2][2], p.z, m[2][3])))};
}

inline float Density::perspective_at(const Vec3f& q, float& beyond) const {
    // Outside the cone around the frustum the scale goes by distance, so that nothing is infinite beside
    // or behind the camera.
    const float r = length(q), inv = 1 / std::max(r, 1e-20f);
    const float depth = std::max(q.z, r * m_edge_cosine);
    const float outside = max(max(abs(q.x - m_middle_x * q.z) - m_half_width * q.z,
                                  abs(q.y - m_middle_y * q.z) - m_half_height * q.z) *
                                  inv,
                              0.0f) +
                          max(-q.z * inv, 0.0f);
    beyond = fma(outside, m_by_place, m_everywhere);
    return m_pixels_per_tangent / std::max(depth, m_near);
}

// The root of the pixels a steradian, over the distance. (Perspective: of the pixels of a square that faces
// the picture's plane.)
float Density::pixels_at(const Vec3f& q, float& beyond) const {
    const float r = length(q), inv = 1 / std::max(r, 1e-20f);
    switch (m_projection) {
    case Projection::Perspective:
        return perspective_at(q, beyond);
    case Projection::Orthographic:
        beyond = max(max(abs(q.x - m_middle_x) / std::max(m_half_width, 1e-20f),
                         abs(q.y - m_middle_y) / std::max(m_half_height, 1e-20f)) -
                         1,
                     0.0f);
        return m_pixels_per_tangent;
    case Projection::Fisheye:
    case Projection::Equisolid: {
        // Equidistant: f along the radius, f a / sin(a) along the circle; equisolid: f^2 of area everywhere.
        constexpr float LeastSine = 0.1f; // around the point straight behind, where the picture's rim is
        const float angle = std::atan2(std::sqrt(fma(q.x, q.x, q.y * q.y)), q.z);
        const float a = min(angle, m_half_angle);
        const bool equal = m_projection == Projection::Equisolid || a < 1e-3f;
        const float stretch = equal ? 1 : a / std::max(std::sin(a), LeastSine);
        beyond = angle - a;
        return m_pixels_per_tangent * std::sqrt(stretch) / std::max(r, m_near);
    }
    case Projection::Spherical: {
        constexpr float LeastCosine = 1.0f / 16; // about the poles, which are as wide as the picture
        const float cosine = std::sqrt(fma(q.x, q.x, q.z * q.z)) * inv;
        beyond = 0;
        return m_pixels_per_tangent / (std::sqrt(std::max(cosine, LeastCosine)) * std::max(r, m_near));
    }
    }
    return 1;
}

float Density::pixels_from(const Pose& pose, const Vec3f& p, float& beyond) const {
    const float pixels = pixels_at(pose.to_camera(p), beyond);
    return pixels * pose.scale / (1 + m_falloff * min(OffscreenSlope * beyond, 1.0f));
}

float Density::pixels_per_unit(const Vec3f& p) const {
    if (m_uniform > 0)
        return m_uniform * factor(p);
    float most = 0, beyond;
    for (const Pose& pose : m_poses)
        most = std::max(most, pixels_from(pose, p, beyond));
    return most * std::max(1.0f, m_stretch) * factor(p);
}

float Density::cells(const Vec3f& a, const Vec3f& b) const {
    return cells_asked(a, b) * factor((a + b) * 0.5f);
}

float Density::cells_asked(const Vec3f& a, const Vec3f& b) const {
    if (m_uniform > 0)
        return length(b - a) * m_uniform * m_cells_per_pixel;
    float most = 0;
    for (const Pose& pose : m_poses)
        most = std::max(most, cells_between(pose.to_camera(a), pose.to_camera(b)));
    return most;
}

void Density::cells(const Vec3f* points, int count, float* out) const {
    if (m_field) {
        for (int i = 0; i + 1 < count; i++)
            out[i] = cells(points[i], points[i + 1]);
        return;
    }
    if (m_uniform > 0) {
        for (int i = 0; i + 1 < count; i++)
            out[i] = length(points[i + 1] - points[i]) * m_uniform * m_cells_per_pixel;
        return;
    }
    std::fill_n(out, count - 1, 0.0f);
    Vec3f q[MostPoints];
    for (const Pose& pose : m_poses) {
        for (int i = 0; i < count; i++)
            q[i] = pose.to_camera(points[i]);
        for (int i = 0; i + 1 < count; i++)
            out[i] = std::max(out[i], cells_between(q[i], q[i + 1]));
    }
}

template <class PixelsAt>
inline float Density::cells_between(const Vec3f& qa, const Vec3f& qb, PixelsAt pixels_at) const {
    const Vec3f middle = (qa + qb) * 0.5f, d = qb - qa;
    float beyond;
    const float at = pixels_at(middle, beyond),
                pixels = at / (1 + m_falloff * min(OffscreenSlope * beyond, 1.0f));
    const bool central = m_projection != Projection::Orthographic;
    const float l2 = length_squared(d);
    const float r2 = central ? length_squared(middle) : 1;
    const float along = central ? dot(d, middle) : d.z;
    const float across2 = l2 - along * along / std::max(r2, 1e-30f);
    const float least =
        std::min(1.0f, LeastForeshortening + beyond); // outside the picture orientation means nothing
    return std::sqrt(std::max(across2, l2 * least * least)) * pixels * m_cells_per_pixel;
}

float Density::cells_between(const Vec3f& qa, const Vec3f& qb) const {
    return cells_between(qa, qb, [&](const Vec3f& q, float& beyond) { return pixels_at(q, beyond); });
}

void Density::cells(const float* a, const float* b, int stride, int count, float* out) const {
    const auto at = [&](const float* p, int i) { return Vec3f{p[i], p[i + stride], p[i + 2 * stride]}; };
    if (m_field || m_uniform > 0 || m_projection != Projection::Perspective || m_poses.size() != 1) {
        for (int i = 0; i < count; i++)
            out[i] = cells(at(a, i), at(b, i));
        return;
    }
    // Eight at a time.
    const Pose pose = m_poses[0];
    const Density& d = *this;
    for (int i = 0; i < count; i++) {
        const float l =
            d.cells_between(pose.to_camera(at(a, i)), pose.to_camera(at(b, i)),
                            [&](const Vec3f& q, float& beyond) { return d.perspective_at(q, beyond); });
        out[i] = max(0.0f, l);
    }
}

float Density::area(const Vec3f& a, const Vec3f& b, const Vec3f& c) const {
    const Vec3f n = cross(b - a, c - a), p = (a + b + c) * (1.0f / 3);
    const float full = 0.5f * length(n), cells_per_pixel = m_cells_per_pixel * factor(p);
    if (m_uniform > 0)
        return full * m_uniform * m_uniform * cells_per_pixel * cells_per_pixel;
    float most = 0;
    for (const Pose& pose : m_poses) {
        float beyond;
        const float pixels = pixels_from(pose, p, beyond);
        const Vec3f w = towards(pose, p);
        const float facing = 0.5f * abs(dot(n, w)) / std::max(length(w), 1e-30f);
        const float seen = std::max(facing, full * std::min(1.0f, LeastForeshortening + beyond));
        most = std::max(most, seen * pixels * pixels * m_stretch);
    }
    return most * cells_per_pixel * cells_per_pixel;
}

Vec3f Density::towards(const Pose& pose, const Vec3f& p) const {
    return m_projection != Projection::Orthographic ? pose.eye - p : -pose.view;
}

Vec3f Density::towards_camera(const Vec3f& p) const {
    return towards(m_poses.front(), p);
}

int round_to_power(float x) {
    int n = 1;
    // sqrt(2) n is where the next power becomes the nearer one.
    while (x > 1.41421356f * float(n) && n < (1 << 24))
        n *= 2;
    return n;
}

void RateRule::coarsen(int halvings, int most) {
    density.coarsen(std::ldexp(1.0f, -halvings));
    slack *= std::ldexp(1.0f, halvings);
    least_range *= std::pow(FinestRange, -float(halvings) / float(most));
}

LineMeasure RateRule::line(const float* lengths, int step, int pieces) {
    // Equal steps serve a line of uneven density best at the quadratic mean of what its parts ask for.
    constexpr float Uneven = 2.5f;
    float sum = 0, squares = 0, peak = 0;
    for (int i = 0; i < pieces; i++) {
        const float l = lengths[i * step];
        sum += l;
        squares += l * l;
        peak = std::max(peak, l);
    }
    if (!std::isfinite(squares))
        return {1, false}; // beyond single precision: nothing to be seen there
    LineMeasure m;
    m.cells = std::sqrt(squares * float(pieces));
    peak *= float(pieces);
    m.uneven = peak > Worthwhile && peak > Uneven * sum;
    return m;
}

std::optional<LineMeasure> RateRule::short_line(const Vec3f* p) const {
    constexpr float Short = 2, Unseen = 1.75f; // times what is tiny; of three points, where nine see 7/8
    const float tiny = std::min(density.edge_pixels(), tolerance() / MostSagitta);
    const float pixels = (length(p[1] - p[0]) + length(p[2] - p[1])) * density.pixels_per_unit(p[1]);
    if (pixels <= tiny)
        return LineMeasure{1, false, true};
    if (pixels <= Short * tiny)
        return line(p, 3, Unseen);
    return std::nullopt;
}

LineMeasure RateRule::line(const Vec3f* p, int count, float unseen) const {
    const int pieces = count - 1;
    float lengths[Density::MostPoints];
    density.cells(p, count, lengths);
    LineMeasure m = line(lengths, 1, pieces);
    if (!shape_only && !is_coarse())
        return m;
    // Of a curve f cut into n equal steps the chords are |f''| / (8 n^2) off; second differences give f''.
    // Only what is across the line counts.
    constexpr float UnevenBend = 3; // times the mean
    float most = 0, sum = 0, turn = 0;
    for (int i = 1; i < pieces; i++) {
        const Vec3f a = p[i] - p[i - 1], b = p[i + 1] - p[i];
        const float across = length(cross(a, b)), along = std::max(length(a + b), length(a));
        if (!(along > 0))
            continue;
        const float bend = 2 * across / along * density.pixels_per_unit(p[i]);
        most = std::max(most, bend);
        sum += bend;
        turn += std::atan2(across, dot(a, b));
    }
    const float deviation = most * float(pieces * pieces) / 8;
    // What positions in single precision are off by is no bend.
    const Vec3f& middle = p[count / 2];
    const float noise = 1e-3f + 4e-6f * length(middle) * density.pixels_per_unit(middle);
    if (!(deviation >= noise) || !std::isfinite(deviation))
        return shape_only ? LineMeasure{std::min(m.cells, 1.0f), false} : m;
    const float by_distance = 1.41f * std::sqrt(deviation / tolerance()); // never rounded down
    if (shape_only && geometry_tolerance > 0) {
        const float by_angle = 1.41f * unseen * turn * (180 / Pi) / (2 * std::max(normal_tolerance, 0.1f));
        m.cells = std::min(m.cells, by_angle);
        m.uneven = false;
    }
    m.cells = std::max(m.cells, by_distance);
    m.uneven |= by_distance > Worthwhile && most * float(pieces - 1) > UnevenBend * sum;
    return m;
}

float RateRule::twist(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& d) const {
    // Two triangles are this far from the bilinear quad at its centre; n x n cells bring it down by n^2.
    // Sliding along a plane is no distance, unless a corner is turned in.
    const Vec3f corners[4] = {a, b, c, d}, n = cross(c - a, d - b), twist = a - b + c - d;
    bool convex = length_squared(n) > 0;
    for (int k = 0; k < 4 && convex; k++)
        convex = dot(cross(corners[(k + 1) % 4] - corners[k], corners[(k + 3) % 4] - corners[k]), n) >=
                 -1e-4f * length_squared(n);
    const float distance = convex ? abs(dot(twist, n)) / length(n) : length(twist);
    const float off = 0.25f * distance * density.pixels_per_unit((a + c) * 0.5f);
    const float by_distance = std::sqrt(off / (slack * std::max(geometry_tolerance, 0.01f)));
    // Its normals turn from corner to corner, and n x n cells have n times less to turn. Beside a pole a
    // corner has no normal, one that is turned in is no twist, and nothing is cut for this alone.
    float turn = 0;
    for (int k = 0; k < 2; k++) {
        const Vec3f p = cross(corners[k + 1] - corners[k], corners[(k + 3) % 4] - corners[k]);
        const Vec3f q = cross(corners[(k + 3) % 4] - corners[k + 2], corners[k + 1] - corners[k + 2]);
        if (std::min(length_squared(p), length_squared(q)) > 1e-2f * length_squared(n))
            turn = std::max(turn, std::atan2(length(cross(p, q)), abs(dot(p, q))));
    }
    const float by_angle = turn * (180 / Pi) / (2 * std::max(normal_tolerance, 0.1f));
    const float most = std::min(float(max_cells), std::max(density.cells(a, c), density.cells(b, d)));
    return std::max(by_distance, std::min(by_angle, most));
}

} // namespace kanuka::dice
