#include "shade/system.h"

namespace kanuka::shade {

std::unique_ptr<ShadingSystem> ShadingSystem::create(const ShadingOptions& options, const scene::Scene& scene,
                                                     Journal& journal, Stats&) {
    return make_shading_system(options, scene, journal, sl::compile_file);
}

} // namespace kanuka::shade
