#include "render/instance_placer.h"

#include <algorithm>

#include "render/de_instance.h"
#include "render/motion.h"
#include "scene/digest.h"

namespace kanuka::render {

namespace {

std::vector<int32_t> some_of(const std::vector<int32_t>& rows, const std::vector<uint32_t>& which) {
    if (rows.empty() || which.empty())
        return rows;
    std::vector<int32_t> some;
    for (const uint32_t i : which)
        some.push_back(rows[i]);
    return some;
}

} // namespace

InstancePlacer::InstancePlacer(const GeometryRequest& request, Geometry& out, const Known& known,
                               size_t first_group, Digester& key)
    : m_request(request), m_out(out), m_views(known.views), m_primvars(known.primvars),
      m_askers(known.askers), m_first_group(first_group), m_key(key),
      m_variations(request.palette, out.variations) {}

bool InstancePlacer::takes_apart(const scene::Group::Instances& in) const {
    return (are_unique(in) && size_t(in.group) >= m_first_group) || m_askers.takes_apart(in);
}

void InstancePlacer::add(const std::vector<scene::Group::Instances>& all, const Parent& parent,
                         bvh::GroupDesc& desc) {
    for (const auto& in : all) {
        if (parent.group < 0 && takes_apart(in))
            continue;
        const scene::Variation& shown = m_primvars.shown(in);
        if (m_request.pages)
            m_key(in.group, std::span<const float>(in.transforms.data(), in.transforms.size()), in.times,
                  parent.render_from_parent, m_out.center_of_scene[size_t(in.group)], shown);
        if (!parent.is_coarser)
            m_request.stats.count.instances += in.count();
        m_out.instanced |= in.count() > 0;
        m_out.matrices.push_back(in.transforms);
        const std::vector<int32_t> rows = m_variations.rows_of(shown, in.count());
        for (Run& run : runs_of(in, parent)) {
            m_out.fades |= !run.levels.empty();
            if (m_request.pages)
                m_key(run.group, std::span<const uint32_t>(run.which), run.levels.size());
            for (const LevelRange& range : run.levels)
                m_key(range.from, range.last);
            if (in.moves())
                add_moving(in, run, rows, parent.render_from_parent, desc);
            else
                add_still(in, std::move(run), rows, parent.render_from_parent, desc);
        }
    }
}

// By the levels that they show: those that show one alone, and those that share it with others.
std::vector<InstancePlacer::Run> InstancePlacer::runs_of(const scene::Group::Instances& in,
                                                         const Parent& parent) {
    const std::vector<int>& levels = m_out.levels_of_scene[size_t(in.group)];
    const size_t count = in.count();
    if (levels.size() == 1 || size_t(in.group) < m_first_group) // nothing is known of what was built before
        return {{levels[0], {}, {}}};
    const GroupView& view = m_views[size_t(in.group) - m_first_group];
    std::vector<Run> runs(2 * levels.size());
    for (size_t k = 0; k < runs.size(); k++)
        runs[k].group = levels[k / 2];
    uint64_t coarser = 0;
    for (size_t i = 0; i < count; i++) {
        const float wanted =
            m_views.wanted(in, i, {parent.render_from_parent, parent.group, parent.pixels_per_unit});
        const ShownLevels shown = shown_levels(view, int(levels.size()), wanted);
        for (const ShownLevel& each : shown.all()) {
            Run& run = runs[2 * size_t(each.level) + (shown.count > 1)];
            run.which.push_back(uint32_t(i));
            if (shown.count > 1)
                run.levels.push_back(each.range);
        }
        coarser += shown.all().back().level > 0;
    }
    if (!parent.is_coarser)
        m_request.stats.count.instances_coarser += coarser;
    std::erase_if(runs, [](const Run& run) { return run.which.empty(); });
    if (runs.size() == 1 && runs[0].which.size() == count && runs[0].levels.empty())
        runs[0].which.clear();
    return runs;
}

// Nobody copies the scene's matrices.
void InstancePlacer::add_still(const scene::Group::Instances& in, Run run, const std::vector<int32_t>& rows,
                               const Transform& render_from_parent, bvh::GroupDesc& desc) {
    // Both are translations, or nothing.
    const auto& m = render_from_parent.m;
    Places places({in.transforms.data(), in.transforms.size()}, {m[0][3], m[1][3], m[2][3]},
                  m_out.center_of_scene[size_t(in.group)]);
    std::vector<int32_t> variations = some_of(rows, run.which);
    if (!run.which.empty()) {
        m_out.numbers.push_back(std::move(run.which));
        places.which = m_out.numbers.back();
    }
    desc.instances.push_back({.group = run.group,
                              .places = places,
                              .variations = std::move(variations),
                              .levels = std::move(run.levels)});
}

void InstancePlacer::add_moving(const scene::Group::Instances& in, const Run& run,
                                const std::vector<int32_t>& rows, const Transform& render_from_parent,
                                bvh::GroupDesc& desc) {
    const size_t count = in.count(), shown = run.which.empty() ? count : run.which.size();
    const Vec3f& c = m_out.center_of_scene[size_t(in.group)];
    const Transform group_from_built = Transform::translate(double(c.x), double(c.y), double(c.z));
    std::vector<MotionPath> paths;
    std::vector<float> matrices;
    bvh::GroupDesc::Instances moving{.group = run.group}, still{.group = run.group};
    std::vector<TransformKey> keys(in.times.size());
    for (size_t n = 0; n < shown; n++) {
        const size_t i = run.which.empty() ? n : run.which[n];
        for (size_t k = 0; k < keys.size(); k++) {
            keys[k].time = in.times[k];
            const float* m = in.transforms.data() + 12 * (k * count + i);
            for (size_t r = 0; r < 3; r++)
                for (size_t c = 0; c < 4; c++)
                    keys[k].transform.m[r][c] = double(m[4 * r + c]);
        }
        const auto in_shutter = keys_in_shutter(keys, m_request.shutter);
        bvh::GroupDesc::Instances& to = in_shutter.empty() ? still : moving;
        if (!rows.empty())
            to.variations.push_back(rows[i]);
        if (!run.levels.empty())
            to.levels.push_back(run.levels[n]);
        if (!in_shutter.empty()) {
            paths.emplace_back(in_shutter, render_from_parent, group_from_built);
            continue;
        }
        matrices.resize(matrices.size() + 12);
        MotionPath(keys, render_from_parent, group_from_built)
            .at(m_request.shutter.open, matrices.data() + matrices.size() - 12);
    }
    m_out.moving |= !paths.empty();
    if (!paths.empty()) {
        m_out.paths.push_back(std::move(paths));
        moving.paths = m_out.paths.back();
        desc.instances.push_back(std::move(moving));
    }
    if (!matrices.empty()) {
        m_out.transforms.push_back(std::move(matrices));
        still.places = m_out.transforms.back();
        desc.instances.push_back(std::move(still));
    }
}

scene::Group::Instances placed(const scene::Group::Instances& in, const Transform& render_from_group,
                               const scene::Variation& variation) {
    scene::Group::Instances out = in;
    std::vector<float> rows(in.transforms.size());
    for (size_t i = 0; 12 * i < rows.size(); i++) {
        const Transform t = render_from_group * place_of(in, i);
        for (size_t k = 0; k < 12; k++)
            rows[12 * i + k] = float(t.m[k / 4][k % 4]);
    }
    out.transforms = std::move(rows);
    out.unique = false;
    out.variation = variation;
    return out;
}

} // namespace kanuka::render
