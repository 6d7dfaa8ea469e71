#include "render/fireflies.h"

#include <algorithm>

namespace kanuka::render {
namespace {

std::string object_name(const scene::Scene& scene, int id) { // they count from one
    if (id <= 0)
        return "";
    std::string number = "object " + std::to_string(id);
    const auto p = std::ranges::find(scene.primitives, id, &scene::Primitive::id); // groups' have others
    if (p == scene.primitives.end())
        return number;
    if (!p->attributes->name.empty())
        return p->attributes->name;
    return p->where.line > 0 ? number + " (" + p->where.str() + ")" : number;
}

std::string lobe_name(const transport::SceneView& view, const transport::LoggedVertex& v) {
    if (v.program >= 0 && v.leaf >= 0)
        for (const auto& node : view.geometry.materials[size_t(v.program)].nodes)
            if (node.leaf == v.leaf)
                return std::string(grid::lobe(node.lobe).name);
    return "";
}

} // namespace

std::vector<Stats::Firefly> explain_fireflies(const transport::BatchCounts& found, transport::Kernel& kernel,
                                              const transport::SceneView& view, const scene::Scene& scene) {
    std::vector<Stats::Firefly> out;
    std::vector<float> aovs(view.settings.aov_is_color.size());
    for (const transport::Firefly& f : found.worst) {
        if (f.x < 0)
            continue;
        transport::PixelSums sums{};
        transport::BatchCounts counts;
        std::vector<transport::LoggedVertex> log;
        transport::BatchRequest r{f.x, f.y, f.x + 1, f.y + 1, f.progression, &sums - f.x, 0, &log, nullptr};
        r.aovs = aovs.data() - ptrdiff_t(f.x) * ptrdiff_t(aovs.size());
        kernel.trace(r, counts);
        out.push_back({f.x, f.y, f.progression, f.luminance, f.mean, {}});
        for (const transport::LoggedVertex& v : log)
            out.back().path.push_back({object_name(scene, v.object), lobe_name(view, v), v.smooth, v.through,
                                       v.distance, v.lights_hit, v.emitted, v.light_samples});
    }
    return out;
}

} // namespace kanuka::render
