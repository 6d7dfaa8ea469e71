// Sixteen lanes. Built a second time for AVX-512, under another name.
#include "lane_stage.h"

#ifndef KANUKA_STAGE
#define KANUKA_STAGE surface_stage_16
#endif

namespace kanuka::transport::testing {

Times KANUKA_STAGE(const TestScene& room, int progressions) {
    return surface_stage<16>(room, progressions);
}

} // namespace kanuka::transport::testing
