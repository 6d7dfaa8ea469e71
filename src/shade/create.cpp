#include "shade/system.h"

namespace kanuka::shade {

std::unique_ptr<ShadingSystem> ShadingSystem::create(const ShadingOptions& options, const scene::Scene& scene,
                                                     Journal& journal, Stats& stats) {
    return make_shading_system(options, scene, journal, stats, sl::compile_file);
}

} // namespace kanuka::shade
