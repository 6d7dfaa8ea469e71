// Transformations. RenderMan multiplies row vectors, p' = p M, and puts each new matrix in front: CTM' = M
// CTM. Here p' = M p with transposed matrices, so each new one goes behind: ctm' = ctm * M.

#include <cmath>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"
#include "scene/coordinate_system.h"

namespace kanuka::ingest::handlers {

namespace {

// A matrix and its multiples mean the same; most code downstream expects the last row to be 0 0 0 1.
Transform from_rows(Context& c, const Call& call) {
    const auto& rows = call.args[0].floats;
    const double w = double(rows[15]);
    // Exporters write rounding errors there: inverses of matrices of floats.
    const auto none = [&](size_t i) {
        double most = 0;
        for (size_t j = i - 3; j < i; j++)
            most = std::max(most, std::abs(double(rows[j])));
        return std::abs(double(rows[i])) <= 1e-6 * std::min(most, std::abs(w));
    };
    const bool affine = w != 0 && none(3) && none(7) && none(11);
    if (!affine)
        c.reports.once(
            Severity::Warning, "projective transformation", call.where,
            std::string(call.spec->name) +
                ": the matrix is projective; shapes under it may come out wrong. Its fourth column should "
                "be 0 0 0 1");
    Transform t;
    for (size_t i = 0; i < 4; i++)
        for (size_t j = 0; j < 4; j++)
            t.m[j][i] = affine && j == 3 ? (i == 3 ? 1 : 0) : double(rows[i * 4 + j]) / (affine ? w : 1);
    return t;
}

} // namespace

void identity(Context& c, Call&) {
    c.replace({});
}

void transform(Context& c, Call& call) {
    if (c.finite(call, 1))
        c.replace(from_rows(c, call));
}

void concat_transform(Context& c, Call& call) {
    if (c.finite(call, 1))
        c.concat(from_rows(c, call));
}

void translate(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (c.finite(call, 1))
        c.concat(Transform::translate(v[0], v[1], v[2]));
}

void scale(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (c.finite(call, 1))
        c.concat(Transform::scale(v[0], v[1], v[2]));
}

// Rotate about z by a positive angle takes x towards y. In RenderMan's left-handed camera space that is the
// left-hand rule, in a right-handed space the right-hand rule: the matrix is Rodrigues' in both.
void rotate(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (!c.finite(call, 1))
        return;
    if (v[1] == 0 && v[2] == 0 && v[3] == 0) {
        if (v[0] != 0)
            c.reports.warning("axis of rotation", call.where,
                              "Rotate about the axis 0 0 0 was left out; give a direction");
        return;
    }
    c.concat(Transform::rotate(v[0], v[1], v[2], v[3]));
}

// Shears along d2 so that d1 turns by `angle` towards d2 (RISpec 4.3). With e the part of d1 across d2 and a
// the angle between d1 and d2, p' = p + (p . e) (cot(a - angle) - cot(a)) d2 does that and keeps the plane
// across e fixed.
void skew(Context& c, Call& call) {
    const auto& v = call.args[0].floats;
    if (!c.finite(call, 1))
        return;
    const Vec3<double> d1(v[1], v[2], v[3]), d2(v[4], v[5], v[6]);
    const double l1 = std::sqrt(d1.x * d1.x + d1.y * d1.y + d1.z * d1.z);
    const double l2 = std::sqrt(d2.x * d2.x + d2.y * d2.y + d2.z * d2.z);
    const double angle = v[0] * 3.14159265358979323846 / 180;
    const double cosine = (d1.x * d2.x + d1.y * d2.y + d1.z * d2.z) / (l1 * l2);
    const double between = std::acos(std::min(1.0, std::max(-1.0, cosine)));
    const double sine = std::sin(between);
    // Written so that NaN (directions of length zero) fails too.
    if (!(l1 > 0 && l2 > 0 && sine > 1e-9) || angle >= between || angle <= between - 3.14159265358979323846) {
        c.reports.error("Skew", call.where,
                        "Skew was left out: the two directions must differ, and the angle be smaller than "
                        "the one between "
                        "them");
        return;
    }
    const double s = 1 / std::tan(between - angle) - cosine / sine;
    const double u[3] = {d2.x / l2, d2.y / l2, d2.z / l2};
    const double w[3] = {d1.x / l1, d1.y / l1, d1.z / l1};
    Transform t;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            t.m[i][j] += s * u[i] * (w[j] - cosine * u[j]) / sine;
    c.concat(t);
}

// x' = x / (z tan(fov/2)), y' likewise, z' = 1 - 1/z.
void perspective(Context& c, Call& call) {
    if (!c.finite(call, 1))
        return;
    const double d = std::tan(call.d(0) * 3.14159265358979323846 / 360);
    if (!(d > 0)) {
        c.reports.error("Perspective", call.where,
                        "Perspective was left out: the field of view must lie between 0 and 180 degrees");
        return;
    }
    Transform t;
    t.m = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, d, -d}, {0, 0, d, 0}}};
    c.concat(t);
}

void coordinate_system(Context& c, Call& call) {
    c.coordinate_systems[call.text(0)] = c.ctm;
}

// Known to what follows in the attribute block: an attribute, which the primitives' shaders see.
void scoped_coordinate_system(Context& c, Call& call) {
    scene::Value v = scene::matrix_value(scene::coordinate_system_name(call.text(0)), c.ctm);
    v.where = call.where;
    c.attributes.edit(FieldUser).user.set(std::move(v));
}

void coord_sys_transform(Context& c, Call& call) {
    if (const scene::Value* scoped =
            c.attributes.shared->user.find(scene::coordinate_system_name(call.text(0)))) {
        c.replace(scene::matrix_of(*scoped));
        return;
    }
    const auto known = c.coordinate_systems.find(call.text(0));
    if (known == c.coordinate_systems.end()) {
        std::string names;
        for (const scene::Value& v : c.attributes.shared->user.values)
            if (scene::is_coordinate_system(v))
                names +=
                    (names.empty() ? "" : ", ") + v.name.substr(scene::coordinate_system_name("").size());
        for (const auto& [name, transform] : c.coordinate_systems)
            names += (names.empty() ? "" : ", ") + name;
        c.reports.error("unknown coordinate system", call.where,
                        "CoordSysTransform: there is no coordinate system \"" + call.text(0) +
                            "\"; there are: " + (names.empty() ? "none" : names));
        return;
    }
    c.replace(known->second);
}

} // namespace kanuka::ingest::handlers
