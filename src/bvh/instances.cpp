// Instances: a user geometry whose callbacks take rays to the space of the group that is placed, and back.
#include <algorithm>
#include <cstring>
#include <limits>

#include "base/tasks.h"
#include "bvh/embree_scene.h"

namespace kanuka::bvh {

namespace {

Matrix concat(const Matrix& a, const float* b) {
    Matrix r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            r[i * 4 + j] = a[i * 4] * b[j] + a[i * 4 + 1] * b[4 + j] + a[i * 4 + 2] * b[8 + j] +
                           (j == 3 ? a[i * 4 + 3] : 0);
    return r;
}

constexpr Matrix Identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

Vec3f apply(const float* m, const Vec3f& p, float w) {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3] * w, m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7] * w,
            m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11] * w};
}

bool traceable(const RTCRay& r) {
    const float largest = std::max({std::abs(r.org_x), std::abs(r.org_y), std::abs(r.org_z),
                                    std::abs(r.dir_x), std::abs(r.dir_y), std::abs(r.dir_z)});
    const float sum = (r.org_x + r.org_y + r.org_z) + (r.dir_x + r.dir_y + r.dir_z); // max() overlooks NaN
    return largest < LargestCoordinate && std::isfinite(sum);
}

Bounds3f placed(const float* m, const RTCBounds& c) {
    Bounds3f b;
    for (int k = 0; k < 8; k++)
        b.extend(apply(
            m, {k & 1 ? c.upper_x : c.lower_x, k & 2 ? c.upper_y : c.lower_y, k & 4 ? c.upper_z : c.lower_z},
            1));
    return b;
}

// The tree interpolates bounds between steps; turning boxes swell in between. Every step's bounds are widened
// by what the neighbouring pieces lack: measured at several times of a piece, and bounded between those by
// how far an arc may lie from its chord.
void bound_path(const MotionPath& path, const RTCBounds& child, int steps, Bounds3f* out) {
    constexpr int Samples = 4; // a piece
    const Bounds3f box{{child.lower_x, child.lower_y, child.lower_z},
                       {child.upper_x, child.upper_y, child.upper_z}};
    if (box.empty()) {
        std::fill_n(out, steps, Bounds3f{{0, 0, 0}, {0, 0, 0}});
        return;
    }
    const auto at = [&](double t) {
        float m[12];
        path.at(t, m);
        return placed(m, child);
    };
    const std::vector<double> knots = path.times();
    std::vector<Bounds3f> exact;
    for (int j = 0; j < steps; j++)
        exact.push_back(at(double(j) / (steps - 1)));
    std::vector<Vec3f> low(size_t(steps), Vec3f(0.0f)), high(size_t(steps), Vec3f(0.0f));
    std::vector<double> times;
    for (int j = 0; j + 1 < steps; j++) {
        const double t0 = double(j) / (steps - 1), t1 = double(j + 1) / (steps - 1);
        times.clear();
        for (int i = 0; i <= Samples; i++)
            times.push_back(t0 + (t1 - t0) * i / Samples);
        for (const double k : knots)
            if (k > t0 && k < t1)
                times.push_back(k);
        std::sort(times.begin(), times.end());
        const Bounds3f &a = exact[size_t(j)], &b = exact[size_t(j) + 1];
        Vec3f lack_low(0.0f), lack_high(0.0f);
        for (size_t i = 0; i < times.size(); i++) {
            double stray = 0;
            if (i > 0)
                stray = path.deviation(times[i - 1], times[i], box);
            if (i + 1 < times.size())
                stray = std::max(stray, path.deviation(times[i], times[i + 1], box));
            const Bounds3f now = at(times[i]);
            const float f = float((times[i] - t0) / (t1 - t0));
            for (int c = 0; c < 3; c++) {
                lack_low[c] =
                    std::max(lack_low[c], a.lo[c] + (b.lo[c] - a.lo[c]) * f - now.lo[c] + float(stray));
                lack_high[c] =
                    std::max(lack_high[c], now.hi[c] + float(stray) - (a.hi[c] + (b.hi[c] - a.hi[c]) * f));
            }
        }
        for (const size_t k : {size_t(j), size_t(j) + 1})
            for (int c = 0; c < 3; c++) {
                low[k][c] = std::max(low[k][c], lack_low[c]);
                high[k][c] = std::max(high[k][c], lack_high[c]);
            }
    }
    for (size_t j = 0; j < size_t(steps); j++)
        for (int c = 0; c < 3; c++) {
            const float rounding = 4e-7f * std::max(std::abs(exact[j].lo[c]), std::abs(exact[j].hi[c]));
            out[j].lo[c] = exact[j].lo[c] - low[j][c] - rounding;
            out[j].hi[c] = exact[j].hi[c] + high[j][c] + rounding;
        }
}

RTCRay ray_in_child(const RTCRayN* rays, unsigned n, unsigned i, const float* inverse) {
    RTCRay r = rtcGetRayFromRayN(const_cast<RTCRayN*>(rays), n, i);
    const Vec3f o = apply(inverse, {r.org_x, r.org_y, r.org_z}, 1),
                d = apply(inverse, {r.dir_x, r.dir_y, r.dir_z}, 0);
    r.org_x = o.x, r.org_y = o.y, r.org_z = o.z;
    r.dir_x = d.x, r.dir_y = d.y, r.dir_z = d.z;
    return r;
}

// What the components of m (p, w) are sums of.
Vec3f sizes(const float* m, const Vec3f& p, float w) {
    const auto row = [&](int r) {
        return std::abs(m[r] * p.x) + std::abs(m[r + 1] * p.y) + std::abs(m[r + 2] * p.z) +
               std::abs(m[r + 3] * w);
    };
    return {row(0), row(4), row(8)};
}

void enter(Context& context, const Instances& in, unsigned prim, const float* group_from_child,
           const float* child_from_group) {
    context.world_from_current[context.depth + 1] =
        concat(context.world_from_current[context.depth], group_from_child);
    context.parent_from_current[context.depth + 1] = group_from_child;
    context.current_from_parent[context.depth + 1] = child_from_group;
    const int32_t above = context.slot[context.depth++];
    context.slot[context.depth] = above < 0 || in.first_slot < 0
                                      ? GroupDesc::Unnumbered
                                      : above + in.first_slot + int32_t(prim) * in.slots;
}

// An instance's matrices for one ray after the other: the same for all, or those of each ray's time.
class Passage {
  public:
    Passage(Context& context, const Instances& in, unsigned prim)
        : m_context(context), m_in(in), m_prim(prim) {
        if (!in.paths.empty()) {
            m_context.depth++; // for the ray to come
            return;
        }
        m_inverse = in.inverses.data() + size_t(prim) * 12;
        enter(m_context, in, prim, in.transforms.data() + size_t(prim) * 12, m_inverse);
    }
    ~Passage() { m_context.depth--; }
    // The ray in the child's space; false = it meets nothing there.
    bool take(const RTCRayN* rays, unsigned n, unsigned i, RTCRay& out) {
        if (!m_in.paths.empty()) {
            m_in.paths[m_prim].at(double(RTCRayN_time(const_cast<RTCRayN*>(rays), n, i)), m_moving);
            if (!invert(m_moving, m_moving_inverse))
                return false;
            m_context.depth--;
            m_inverse = m_moving_inverse;
            enter(m_context, m_in, m_prim, m_moving, m_inverse);
        }
        out = ray_in_child(rays, n, i, m_inverse);
        return traceable(out);
    }

  private:
    Context& m_context;
    const Instances& m_in;
    unsigned m_prim;
    const float* m_inverse = nullptr;
    float m_moving[12], m_moving_inverse[12];
};

} // namespace

// To first order, rounding moves a point by so much times a few units in the last place: at each level the
// ray's start is taken down by the inverse, and points come up by the matrix (Higham 2002, Accuracy and
// Stability of Numerical Algorithms, section 3.5).
float magnitude_at(const Context& context, const Vec3f& p) {
    Vec3f at = p, sum(0.0f);
    for (int k = context.depth; k > 0; k--) {
        const float *up = context.parent_from_current[k], *down = context.current_from_parent[k];
        if (std::equal(up, up + 12, Identity.data())) // rounds nothing: what was read on demand has it
            continue;
        const Vec3f parent = apply(up, at, 1);
        sum += sizes(context.world_from_current[size_t(k)].data(), sizes(down, parent, 1), 0) +
               sizes(context.world_from_current[size_t(k) - 1].data(), sizes(up, at, 1), 0);
        at = parent;
    }
    return std::max({sum.x, sum.y, sum.z});
}

bool invert(const float* m, float* out) {
    const double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], i = m[10];
    const double det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    if (!(std::abs(det) > 1e-38))
        return false;
    const double s = 1 / det;
    const double r[9] = {(e * i - f * h) * s, (c * h - b * i) * s, (b * f - c * e) * s,
                         (f * g - d * i) * s, (a * i - c * g) * s, (c * d - a * f) * s,
                         (d * h - e * g) * s, (b * g - a * h) * s, (a * e - b * d) * s};
    for (int row = 0; row < 3; row++) {
        for (int col = 0; col < 3; col++)
            out[row * 4 + col] = float(r[row * 3 + col]);
        out[row * 4 + 3] = float(-(r[row * 3] * m[3] + r[row * 3 + 1] * m[7] + r[row * 3 + 2] * m[11]));
    }
    return true;
}

void instance_bounds(const RTCBoundsFunctionArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    const Bounds3f b = in.paths.empty() ? placed(in.transforms.data() + size_t(args->primID) * 12, in.child)
                                        : in.bounds[size_t(args->primID) * size_t(in.steps) + args->timeStep];
    *args->bounds_o = {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0};
}

void bound_paths(Instances& in) {
    constexpr double TurnAStep = 0.2; // radians: boxes that turn by that much fit well enough
    constexpr int MostSteps = 65;     // Embree's limit is 129
    double pieces = 1;
    for (const MotionPath& path : in.paths)
        pieces = std::max({pieces, path.turning() / TurnAStep, double(path.times().size()) - 1});
    in.steps = 1 + int(std::min(std::ceil(pieces), double(MostSteps - 1)));
    in.bounds.resize(in.paths.size() * size_t(in.steps));
    tasks::parallel_chunks(in.paths.size(), 256, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            bound_path(in.paths[i], in.child, in.steps, in.bounds.data() + i * size_t(in.steps));
    });
}

void instance_intersect(const RTCIntersectFunctionNArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (context.depth >= MaxDepth)
        return;
    Passage passage(context, in, args->primID);
    RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
    RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        RTCRayHit rh;
        if (!passage.take(rays, args->N, i, rh.ray))
            continue;
        rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        const float before = rh.ray.tfar;
        intersect_group(*in.target, context, rh);
        if (rh.hit.geomID == RTC_INVALID_GEOMETRY_ID || !(rh.ray.tfar < before))
            continue;
        RTCRayN_tfar(rays, args->N, i) = rh.ray.tfar;
        rtcCopyHitToHitN(hits, &rh.hit, args->N, i);
        if (rh.hit.instID[0] == RTC_INVALID_GEOMETRY_ID) { // found here, not deeper: note where "here" is
            for (int k = 0; k < 12; k++)
                context.hit_transform[k * context.width + int(rh.ray.id)] =
                    context.world_from_current[context.depth][k];
            const RTCRay& r = rh.ray;
            context.hit_magnitude[r.id] =
                magnitude_at(context, {r.org_x + r.tfar * r.dir_x, r.org_y + r.tfar * r.dir_y,
                                       r.org_z + r.tfar * r.dir_z});
            context.hit_group[rh.ray.id] = in.group;
            const int32_t slot = context.slot[context.depth];
            context.hit_slot_shift[rh.ray.id] = slot < 0 || in.first_emitter < 0
                                                    ? std::numeric_limits<int32_t>::min()
                                                    : slot - in.first_emitter;
        }
        RTCHitN_instID(hits, args->N, i, 0) = 0; // for the levels above: not one of your own geometries
    }
}

void instance_occluded(const RTCOccludedFunctionNArguments* args) {
    const Instances& in = *static_cast<const Instances*>(args->geometryUserPtr);
    Context& context = *reinterpret_cast<Context*>(args->context);
    if (context.depth >= MaxDepth)
        return;
    Passage passage(context, in, args->primID);
    for (unsigned i = 0; i < args->N; i++) {
        if (args->valid[i] == 0)
            continue;
        RTCRay ray;
        if (!passage.take(args->ray, args->N, i, ray))
            continue;
        occluded_group(*in.target, context, ray);
        if (ray.tfar < 0)
            RTCRayN_tfar(args->ray, args->N, i) = -std::numeric_limits<float>::infinity();
    }
}

} // namespace kanuka::bvh
