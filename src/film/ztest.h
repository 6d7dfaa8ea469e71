// Statistical comparison of a noisy picture with a stored reference: does each pixel lie where chance may put
// it?
#pragma once

#include <vector>

#include "film/film.h"

namespace kanuka::film {

struct ZTestOptions {
    // Chance that the whole test fails where nothing is wrong; per-pixel levels follow by Šidák's correction.
    double significance = 0.01;
    // Where no variance of the test picture is given: the reference's, times reference_samples /
    // test_samples. Safer than an estimate from few samples, which misses rare bright paths together with
    // their variance.
    double reference_samples = 1, test_samples = 1;
    std::vector<std::string> channels{"R", "G", "B"};
};

struct ZTestResult {
    uint64_t tests = 0, rejected = 0; // pixels times channels
    double level = 0;                 // rejected: p below this, 1 - (1 - significance)^(1 / tests)
    double smallest_p = 1;
    int worst_x = 0, worst_y = 0;
    std::string worst_channel;
    struct Pixel {
        int x, y;
    };
    std::vector<Pixel> rejected_pixels; // row by row, each once
    Picture p_values;                   // the channels tested, as float
    bool passed() const { return rejected == 0; }
};

// `reference_variance` and `test_variance` are variances of the means, not of samples; test_variance may be
// null. All are pictures of one size with the channels of the options. A pixel that is not finite is rejected
// with p = 0. Throws Error for sizes or channels that do not fit.
ZTestResult z_test(const Picture& reference, const Picture& reference_variance, const Picture& test,
                   const Picture* test_variance, const ZTestOptions& options = {});

} // namespace kanuka::film
