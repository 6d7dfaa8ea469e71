// Requests in motion blocks that shading asks once for all times: what they say on the mean.
#pragma once

#include <span>
#include <vector>

#include "ingest/rib/call.h"

namespace kanuka::ingest {

// How much each sample counts: what is linear between the times, and stands still before the first and after
// the last, has the mean sum of w[i] v[i] while the shutter is open. `opening` is that of Options. Adds up
// to 1.
std::vector<double> shutter_weights(std::span<const double> times, double open, double close,
                                    std::span<const float> opening);

// The first sample, with the weighted mean of all in place of its numbers. Texts, integers, and parameters
// that not all samples have alike are those of the first.
Call mean_call(const std::vector<Call>& samples, std::span<const double> weights);

} // namespace kanuka::ingest
