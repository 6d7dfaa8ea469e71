#include "ingest/rib/motion_mean.h"

#include <algorithm>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"
#include "ingest/rib/requests.h"
#include "scene/shutter.h"

namespace kanuka::ingest {

namespace {

bool same(const Location& a, const Location& b) {
    return a.line == b.line && a.column == b.column && a.file == b.file;
}

// Adds the integral over [a, b] of each sample's hat function, times `openness`.
void add_piece(std::span<const double> times, double a, double b, double openness, std::vector<double>& w) {
    const size_t last = times.size() - 1;
    if (a < times[0])
        w[0] += openness * (std::min(b, times[0]) - a);
    if (b > times[last])
        w[last] += openness * (b - std::max(a, times[last]));
    for (size_t i = 0; i < last; i++) {
        const double from = std::max(a, times[i]), to = std::min(b, times[i + 1]);
        if (!(from < to))
            continue;
        const double share =
            ((from + to) / 2 - times[i]) / (times[i + 1] - times[i]); // at its middle: linear
        w[i] += openness * (to - from) * (1 - share);
        w[i + 1] += openness * (to - from) * share;
    }
}

std::vector<float> mean(const std::vector<const float*>& all, size_t size, std::span<const double> weights) {
    std::vector<float> m(size);
    for (size_t k = 0; k < size; k++) {
        double sum = 0;
        for (size_t i = 0; i < all.size(); i++)
            sum += weights[i] * double(all[i][k]);
        m[k] = float(sum);
    }
    return m;
}

} // namespace

std::vector<double> shutter_weights(std::span<const double> times, double open, double close,
                                    std::span<const float> opening) {
    std::vector<double> w(times.size(), 0.0);
    if (times.size() < 2 || !(open < close)) { // an instant
        if (times.empty())
            return w;
        const double t = std::clamp(open, times.front(), times.back());
        const size_t next = size_t(std::ranges::upper_bound(times, t) - times.begin());
        if (next == times.size()) {
            w.back() = 1;
            return w;
        }
        w[next] = (t - times[next - 1]) / (times[next] - times[next - 1]);
        w[next - 1] = 1 - w[next];
        return w;
    }
    constexpr int Fine = 1024; // of a shutter that takes time to open: its openness in each piece's middle
    const int pieces = opening.empty() ? 1 : Fine;
    for (int k = 0; k < pieces; k++)
        add_piece(times, open + (close - open) * k / pieces, open + (close - open) * (k + 1) / pieces,
                  double(scene::shutter_openness(opening, (float(k) + 0.5f) / float(pieces))), w);
    double sum = 0;
    for (const double x : w)
        sum += x;
    for (double& x : w)
        x = sum > 0 ? x / sum : 0;
    if (!(sum > 0))
        w[0] = 1;
    return w;
}

Call mean_call(const std::vector<Call>& samples, std::span<const double> weights) {
    Call call = samples[0];
    const auto of_all = [&](size_t size, auto floats) {
        std::vector<const float*> all;
        for (const Call& s : samples)
            if (const auto f = floats(s); f.size() == size)
                all.push_back(f.data());
        return all.size() == samples.size() ? all : std::vector<const float*>();
    };
    for (size_t a = 0; a < call.spec->arg_count(); a++) {
        if (call.spec->args[a].type != ArgType::FloatArray)
            continue;
        const size_t size = call.args[a].floats.size();
        if (const auto all =
                of_all(size, [&](const Call& s) { return std::span<const float>(s.args[a].floats); });
            !all.empty())
            call.args[a].floats = mean(all, size, weights);
    }
    for (scene::Value& v : call.params.values) {
        if (v.floats.empty())
            continue;
        const auto floats = [&](const Call& s) -> std::span<const float> {
            const scene::Value* other = s.params.find(v.name);
            return other && other->type == v.type ? std::span(other->floats.data(), other->floats.size())
                                                  : std::span<const float>();
        };
        if (const auto all = of_all(v.floats.size(), floats); !all.empty())
            v.floats = mean(all, v.floats.size(), weights);
    }
    return call;
}

// ---- the context's part -----------------------------------------------------------------------------

// The samples of a request that holds for all times: done once, with their mean.
void Context::finish_mean(std::vector<double> times, std::vector<Call> samples) {
    const Call& first = samples[0];
    const std::string name(first.spec->name);
    times.resize(std::min(times.size(), samples.size()));
    for (const Call& s : samples)
        if (s.spec->params == Params::Shader && s.text(0) != first.text(0)) {
            reports.once(Severity::Warning, "motion of " + name + " by name", s.where,
                         name + " \"" + first.text(0) + "\" and \"" + s.text(0) +
                             "\" in one motion block: a shader cannot become another; the first was used");
            samples.resize(1);
            times.resize(1);
            break;
        }
    if (samples.size() > 1)
        reports.once(
            Severity::Info, "motion of " + name, first.where,
            name + " does not change while the shutter is open: it has the mean of its numbers over that "
                   "time");
    std::vector<double> weights = weights_of(times);
    Call call = mean_call(samples, weights);
    constexpr size_t Most = 1000;
    const bool keep =
        !m_in_world && samples.size() > 1 && m_means.size() < Most; // the shutter may still change
    if (keep)
        m_means.push_back({std::move(times), std::move(samples), weights, attributes.shared->color,
                           attributes.shared->opacity});
    call.spec->handler(*this, call);
    if (keep) {
        m_means.back().color = attributes.shared->color;
        m_means.back().opacity = attributes.shared->opacity;
    }
}

std::vector<double> Context::weights_of(std::span<const double> times) const {
    const scene::Options& o = options.options;
    return shutter_weights(times, double(o.shutter_open), double(o.shutter_close), o.shutter_opening);
}

// WorldBegin: means of what was taken before Shutter were those of another time.
void Context::mend_means() {
    for (const MeanOverShutter& m : m_means) {
        const std::vector<double> weights = weights_of(m.times);
        if (weights == m.weights)
            continue;
        Call call = mean_call(m.samples, weights);
        if (call.spec->handler == handlers::color || call.spec->handler == handlers::opacity) {
            const bool color = call.spec->handler == handlers::color;
            if (color ? attributes.shared->color == m.color : attributes.shared->opacity == m.opacity)
                call.spec->handler(*this, call);
            continue;
        }
        lights.set_parameters(call.where, call.params);
        scene::Attributes& a = attributes.edit(0);
        for (std::optional<scene::ShaderRef>* slot :
             {&a.surface, &a.displacement, &a.interior, &a.exterior, &a.atmosphere, &a.area_light}) {
            if (!*slot || !same((*slot)->where, call.where))
                continue;
            scene::ShaderRef ref = shader(call, 0);
            if (slot == &a.area_light)
                handlers::shaped_light(ref);
            (*slot)->parameters = std::move(ref.parameters);
        }
    }
    m_means.clear();
}

} // namespace kanuka::ingest
