// A two-sided Z-test a pixel, after the way Mitsuba 3 tests its renderings (Jakob et al. 2022): z = (t - r) /
// sigma is standard normal where both pictures have the same expectation. How we differ: rounding to the
// stored format counts as variance, so that pixels without noise are compared to the last bit that is stored,
// and no share of failures is let pass.
#include "film/ztest.h"

#include <cmath>

namespace kanuka::film {

namespace {

const Picture::Channel& channel_of(const Picture& picture, const std::string& name, const Picture& model,
                                   const char* what) {
    if (picture.width != model.width || picture.height != model.height)
        throw Error(std::string("Z-test: the ") + what + " picture is " + std::to_string(picture.width) +
                    " x " + std::to_string(picture.height) + "; the reference is " +
                    std::to_string(model.width) + " x " + std::to_string(model.height));
    const Picture::Channel* channel = picture.find(name);
    if (!channel || channel->data.size() != size_t(model.width) * model.height)
        throw Error(std::string("Z-test: the ") + what + " picture has no channel \"" + name + "\"");
    return *channel;
}

// Variance of a value rounded to half or float: uniform over one unit in the last place. Float sums of many
// samples lose a few bits more than the last.
double rounding_variance(double value, bool half) {
    const double half_ulp = half ? std::max(std::abs(value) * 0x1p-11, 0x1p-25) : std::abs(value) * 0x1p-20;
    return half_ulp * half_ulp / 3;
}

} // namespace

ZTestResult z_test(const Picture& reference, const Picture& reference_variance, const Picture& test,
                   const Picture* test_variance, const ZTestOptions& options) {
    if (!(options.significance > 0 && options.significance < 1) || !(options.test_samples > 0) ||
        !(options.reference_samples > 0))
        throw Error("Z-test: significance must lie between 0 and 1, and sample counts above 0");
    if (reference.width <= 0 || reference.height <= 0 || options.channels.empty())
        throw Error("Z-test: there is nothing to test");
    const size_t pixels = size_t(reference.width) * reference.height;

    ZTestResult result;
    result.tests = pixels * options.channels.size();
    // 1 - (1 - a)^(1/n), without cancellation for large n.
    result.level = -std::expm1(std::log1p(-options.significance) / double(result.tests));
    result.p_values.width = reference.width;
    result.p_values.height = reference.height;
    std::vector<bool> bad(pixels, false);

    for (const std::string& name : options.channels) {
        const auto& r = channel_of(reference, name, reference, "reference");
        const auto& rv = channel_of(reference_variance, name, reference, "reference variance");
        const auto& t = channel_of(test, name, reference, "tested");
        const auto* tv =
            test_variance ? &channel_of(*test_variance, name, reference, "tested variance") : nullptr;
        Picture::Channel out{name, false, std::vector<float>(pixels)};
        for (size_t i = 0; i < pixels; i++) {
            const double var_r = rv.data[i];
            const double var_t =
                tv ? double(tv->data[i]) : var_r * (options.reference_samples / options.test_samples);
            const double variance =
                var_r + var_t + rounding_variance(r.data[i], r.half) + rounding_variance(t.data[i], t.half);
            const double difference = double(t.data[i]) - r.data[i];
            double p = 0;
            if (difference == 0)
                p = 1;
            else if (std::isfinite(difference) && std::isfinite(variance) && variance > 0)
                p = std::erfc(std::abs(difference) / std::sqrt(2 * variance));
            out.data[i] = float(p);
            if (p < result.level) {
                result.rejected++;
                bad[i] = true;
            }
            if (p < result.smallest_p) {
                result.smallest_p = p;
                result.worst_x = int(i % size_t(reference.width));
                result.worst_y = int(i / size_t(reference.width));
                result.worst_channel = name;
            }
        }
        result.p_values.channels.push_back(std::move(out));
    }
    for (size_t i = 0; i < pixels; i++)
        if (bad[i])
            result.rejected_pixels.push_back(
                {int(i % size_t(reference.width)), int(i / size_t(reference.width))});
    return result;
}

} // namespace kanuka::film
