#include "ingest/rib/motion.h"

#include <algorithm>
#include <cmath>

#include "ingest/rib/handlers.h"
#include "ingest/rib/primvars.h"

namespace kanuka::ingest {

namespace {

// Matrices say nothing of whole turns, and products of moving matrices are exact at their keys alone:
// rotations get keys in between.
constexpr double DegreesAKey = 5;
constexpr double MostKeys = 120; // between two samples

std::vector<TransformKey> with_turns(const std::vector<TransformKey>& keys,
                                     const std::vector<std::array<double, 4>>& turns) {
    std::vector<TransformKey> out;
    for (size_t i = 0; i < keys.size(); i++) {
        out.push_back(keys[i]);
        if (i + 1 == keys.size())
            break;
        const auto &a = turns[i], &b = turns[i + 1];
        const bool one_axis = a[1] == b[1] && a[2] == b[2] && a[3] == b[3];
        const int pieces = int(std::min(std::ceil(std::abs(b[0] - a[0]) / DegreesAKey), MostKeys));
        for (int k = 1; one_axis && k < pieces; k++) {
            const double f = double(k) / pieces;
            out.push_back({keys[i].time + (keys[i + 1].time - keys[i].time) * f,
                           Transform::rotate(a[0] + (b[0] - a[0]) * f, a[1], a[2], a[3])});
        }
    }
    return out;
}

bool same_topology(const scene::Geometry& a, const scene::Geometry& b) {
    if (a.index() != b.index())
        return false;
    const auto same = [](const auto& x, const auto& y) { return std::ranges::equal(x, y); };
    if (const auto* m = std::get_if<scene::PolygonMesh>(&a)) {
        const auto& o = std::get<scene::PolygonMesh>(b);
        return same(m->loops_per_face, o.loops_per_face) && same(m->vertices_per_loop, o.vertices_per_loop) &&
               same(m->vertices, o.vertices);
    }
    if (const auto* m = std::get_if<scene::SubdivisionMesh>(&a)) {
        const auto& o = std::get<scene::SubdivisionMesh>(b);
        return m->scheme == o.scheme && same(m->vertices_per_face, o.vertices_per_face) &&
               same(m->vertices, o.vertices);
    }
    if (const auto* m = std::get_if<scene::PatchMesh>(&a)) {
        const auto& o = std::get<scene::PatchMesh>(b);
        return m->cubic == o.cubic && m->nu == o.nu && m->nv == o.nv && m->u_periodic == o.u_periodic &&
               m->v_periodic == o.v_periodic;
    }
    if (const auto* m = std::get_if<scene::NuPatch>(&a)) {
        const auto& o = std::get<scene::NuPatch>(b);
        return m->nu == o.nu && m->nv == o.nv && m->u_order == o.u_order && m->v_order == o.v_order;
    }
    if (const auto* m = std::get_if<scene::Curves>(&a)) {
        const auto& o = std::get<scene::Curves>(b);
        return m->cubic == o.cubic && m->periodic == o.periodic &&
               same(m->vertices_per_curve, o.vertices_per_curve);
    }
    if (const auto* m = std::get_if<scene::Quadric>(&a))
        return m->kind == std::get<scene::Quadric>(b).kind;
    return true;
}

size_t positions(const scene::ValueList& values) {
    const scene::Value* p = values.find("P");
    p = p ? p : values.find("Pw");
    return p ? p->floats.size() : 0;
}

} // namespace

bool is_transformation(const RequestSpec& spec) {
    namespace h = handlers;
    for (const auto handler : {h::identity, h::transform, h::concat_transform, h::perspective, h::translate,
                               h::rotate, h::scale, h::skew})
        if (spec.handler == handler)
            return true;
    return false;
}

std::shared_ptr<const scene::Motion> moving_place(const std::vector<TransformKey>& keys) {
    if (keys.size() < 2)
        return nullptr;
    auto motion = std::make_shared<scene::Motion>();
    motion->places = keys;
    return motion;
}

void Context::concat(const Transform& t) {
    ctm = ctm * t;
    for (TransformKey& k : ctm_keys)
        k.transform = k.transform * t;
}

void Context::replace(const Transform& t) {
    ctm = t;
    ctm_keys.clear();
    m_motion.absolute = true; // seen where a sample has just been taken
}

void Context::begin_motion(const Call& call) {
    open(BlockKind::Motion, call.where);
    m_motion = {};
    m_motion.where = call.where;
    for (const float t : call.args[0].floats)
        m_motion.times.push_back(double(t));
    auto& times = m_motion.times;
    const bool rising =
        std::ranges::adjacent_find(times, [](double a, double b) { return !(a < b); }) == times.end();
    if (!rising || times.empty() || !std::ranges::all_of(times, [](double t) { return std::isfinite(t); })) {
        reports.error("motion times", call.where,
                      "MotionBegin: the times must rise; the first sample stands for all");
        times.assign(1, 0.0);
        m_motion.wrong_times = true;
    }
}

void Context::end_motion(const Location& where) {
    const bool empty = m_motion.calls == 0;
    if (close(BlockKind::Motion, where) && empty)
        reports.warning("empty motion block", where, "MotionEnd: the motion block has no sample");
}

// One more sample.
void Context::motion_sample(Call& call) {
    const size_t sample = size_t(m_motion.calls) - 1;
    if (sample >= m_motion.times.size()) {
        if (!m_motion.wrong_times && (m_motion.times.size() > 1 || sample == 1))
            reports.once(Severity::Warning, "motion samples", call.where,
                         std::string(call.spec->name) + ": the motion block has more samples than the " +
                             std::to_string(m_motion.times.size()) + " times of MotionBegin at " +
                             m_motion.where.str() + "; those beyond were left out");
        return;
    }
    if (!is_transformation(*call.spec)) {
        constexpr size_t Most = 10'000; // kilobytes each, in a broken file
        if (!(call.spec->scopes & InOuter))
            call.spec->handler(*this, call);
        else if (m_motion.samples.size() < Most)
            m_motion.samples.push_back(call);
        else
            reports.once(Severity::Warning, "motion samples", call.where,
                         std::string(call.spec->name) + ": of the motion block at " + m_motion.where.str() +
                             " the first " + std::to_string(Most) + " samples count");
        return;
    }
    // The request's own matrix: what it makes of the identity.
    const Transform still = ctm;
    const std::vector<TransformKey> keys = std::move(ctm_keys);
    ctm = {};
    ctm_keys.clear();
    m_motion.absolute = false;
    call.spec->handler(*this, call);
    m_motion.local.push_back({m_motion.times[sample], ctm});
    if (call.spec->handler == handlers::rotate) {
        const auto& v = call.args[0].floats;
        m_motion.turns.push_back({double(v[0]), double(v[1]), double(v[2]), double(v[3])});
    }
    ctm = still;
    ctm_keys = keys;
}

// A further sample of the primitive that the block has added.
void Context::add_shape(Call& call, scene::Geometry geometry) {
    if (m_motion.shapes.empty() || !check_primvars(call, geometry, reports))
        return; // the first was left out, or this one is broken, which has been reported
    const scene::Motion::Shape& first = m_motion.shapes[0];
    if (!same_topology(first.geometry, geometry) || positions(first.primvars) != positions(call.params)) {
        reports.error("shape of motion", call.where,
                      std::string(call.spec->name) +
                          ": a motion sample must have the faces and vertices of the first; it was left out");
        return;
    }
    m_motion.shapes.push_back(
        {m_motion.times[size_t(m_motion.calls) - 1], std::move(geometry), std::move(call.params)});
}

void Context::finish_motion() {
    MotionBlock block = std::move(m_motion);
    m_motion = {};
    if (!block.local.empty()) {
        if (block.turns.size() == block.local.size())
            block.local = with_turns(block.local, block.turns);
        if (block.local.size() == 1) {
            block.absolute ? replace(block.local[0].transform) : concat(block.local[0].transform);
        } else {
            ctm_keys = block.absolute ? block.local : compose(ctm_keys, ctm, block.local, {});
            ctm = ctm_keys[0].transform;
        }
    }
    if (!block.samples.empty())
        finish_mean(std::move(block.times), std::move(block.samples));
    if (block.shapes.size() > 1 && block.index >= 0) {
        scene::Primitive& p = block.object >= 0
                                  ? objects.record(block.object).members[size_t(block.index)].primitive
                                  : m_scene.primitives[size_t(block.index)];
        auto motion =
            p.motion ? std::make_shared<scene::Motion>(*p.motion) : std::make_shared<scene::Motion>();
        motion->shapes = std::move(block.shapes);
        p.motion = std::move(motion);
    }
}

} // namespace kanuka::ingest
