#include "scene/shutter.h"

#include <algorithm>
#include <cmath>

namespace kanuka::scene {

namespace {

double bezier(double a, double b, double c, double d, double t) {
    const double s = 1 - t;
    return s * s * s * a + 3 * s * s * t * b + 3 * s * t * t * c + t * t * t * d;
}

// Height of the curve over x; its x rises (the inner points lie between the ends).
double height(double x0, double y0, const float* inner, double x3, double y3, double x) {
    double lo = 0, hi = 1;
    for (int i = 0; i < 40; i++) {
        const double t = (lo + hi) / 2;
        (bezier(x0, double(inner[0]), double(inner[2]), x3, t) < x ? lo : hi) = t;
    }
    return std::clamp(bezier(y0, double(inner[1]), double(inner[3]), y3, (lo + hi) / 2), 0.0, 1.0);
}

} // namespace

float shutter_openness(std::span<const float> o, float time) {
    if (o.size() < 2)
        return 1;
    if (!(time >= 0 && time <= 1))
        return 0;
    const bool curved = o.size() >= 10;
    if (time < o[0])
        return curved ? float(height(0, 0, &o[2], double(o[0]), 1, double(time))) : time / o[0];
    if (time > o[1])
        return curved ? float(height(double(o[1]), 1, &o[6], 1, 0, double(time))) : (1 - time) / (1 - o[1]);
    return 1;
}

std::optional<std::string> fault_of_opening(std::span<const float> o) {
    if (o.empty())
        return std::nullopt;
    if (o.size() != 2 && o.size() != 10)
        return "expected 2 numbers (when it is open, when it begins to close) or 10 (and the inner points of "
               "two "
               "curves), found " +
               std::to_string(o.size());
    for (const float x : o)
        if (!(x >= 0 && x <= 1))
            return "the numbers must lie between 0 and 1";
    if (!(o[0] <= o[1]))
        return "it must be open before it closes: the first number at most the second";
    if (o.size() == 10 && !(o[2] <= o[0] && o[4] <= o[0] && o[6] >= o[1] && o[8] >= o[1]))
        return "the curves' inner points must lie before the first time and after the second";
    return std::nullopt;
}

std::vector<float> shutter_quantiles(std::span<const float> opening) {
    if (opening.size() < 2)
        return {};
    // Openness is sampled at the ends of fine pieces; on each, light comes in at the mean of its ends.
    constexpr int Fine = 1 << 13;
    std::vector<double> cumulative(Fine + 1, 0.0);
    float before = shutter_openness(opening, 0);
    for (int i = 1; i <= Fine; i++) {
        const float now = shutter_openness(opening, float(i) / Fine);
        cumulative[size_t(i)] = cumulative[size_t(i) - 1] + double(before) + double(now);
        before = now;
    }
    if (!(cumulative.back() > 0))
        return {};
    std::vector<float> out(ShutterSegments + 1);
    size_t at = 0;
    for (int k = 0; k <= ShutterSegments; k++) {
        const double target = cumulative.back() * k / ShutterSegments;
        while (at + 2 < cumulative.size() &&
               (cumulative[at + 1] < target || cumulative[at + 1] == cumulative[at]))
            at++;
        const double piece = cumulative[at + 1] - cumulative[at];
        const double f = piece > 0 ? std::clamp((target - cumulative[at]) / piece, 0.0, 1.0) : 0.0;
        out[size_t(k)] = float((double(at) + f) / Fine);
    }
    return out;
}

} // namespace kanuka::scene
