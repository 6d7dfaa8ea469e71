#include "transport/path_shares.h"

#include <algorithm>

namespace kanuka::transport {

namespace {

// The steps that an event is, with the part of the light that takes each.
struct Steps {
    int count;
    PathStep step[2];
    float part[2][Wavelengths];

    explicit Steps(const PathShares::Event& e) : count(1) {
        const auto of_surface = [&](PathStep reflected) {
            return PathStep(
                int(reflected) +
                (e.transmits ? int(PathStep::TransmitDiffuse) - int(PathStep::ReflectDiffuse) : 0));
        };
        std::fill_n(part[0], Wavelengths, 1.0f);
        if (e.in_volume) {
            step[0] = PathStep::Volume;
        } else if (e.singular) {
            step[0] = of_surface(PathStep::ReflectSingular);
        } else {
            count = 2;
            step[0] = of_surface(PathStep::ReflectDiffuse), step[1] = of_surface(PathStep::ReflectGlossy);
            for (int k = 0; k < Wavelengths; k++)
                part[0][k] = e.diffuse[k], part[1][k] = 1 - e.diffuse[k];
        }
    }
};

} // namespace

PathShares::PathShares(const PathExpressions& expressions, int paths)
    : m_expressions(expressions), m_paths(paths) {
    size_t states = 0;
    for (const PathAutomaton& a : expressions.automata) {
        m_first_state.push_back(states);
        states += a.states.size();
    }
    const size_t all = expressions.automata.size();
    m_share.resize(states * size_t(paths) * Wavelengths);
    m_radiance.resize(all * size_t(paths) * Wavelengths);
}

void PathShares::begin(int paths) {
    std::ranges::fill(m_share, 0.0f);
    std::ranges::fill(m_radiance, 0.0f);
    for (const size_t first : m_first_state)
        std::fill_n(share(first, 0), size_t(paths) * Wavelengths, 1.0f);
}

void PathShares::scatter(int path, const Event& event) {
    const Steps steps(event);
    for (size_t e = 0; e < m_expressions.automata.size(); e++) {
        const std::vector<PathAutomaton::State>& states = m_expressions.automata[e].states;
        float before[PathAutomaton::MostStates][Wavelengths];
        for (size_t s = 0; s < states.size(); s++) {
            float* now = share(m_first_state[e] + s, path);
            std::copy_n(now, Wavelengths, before[s]);
            std::fill_n(now, Wavelengths, 0.0f);
        }
        for (size_t s = 0; s < states.size(); s++)
            for (int i = 0; i < steps.count; i++) {
                const uint8_t next = states[s].next[size_t(steps.step[i])];
                if (next == PathAutomaton::Dead)
                    continue;
                float* to = share(m_first_state[e] + next, path);
                for (int k = 0; k < Wavelengths; k++)
                    to[k] += before[s][k] * steps.part[i][k];
            }
    }
}

void PathShares::accepted(size_t expression, int path, const Event* event, uint64_t light, Spectrum4& part) {
    const std::vector<PathAutomaton::State>& states = m_expressions.automata[expression].states;
    std::fill_n(part, Wavelengths, 0.0f);
    for (size_t s = 0; s < states.size(); s++) {
        const float* of_state = share(m_first_state[expression] + s, path);
        if (!event) {
            if (states[s].accepts & light)
                for (int k = 0; k < Wavelengths; k++)
                    part[k] += of_state[k];
            continue;
        }
        const Steps steps(*event);
        for (int i = 0; i < steps.count; i++) {
            const uint8_t next = states[s].next[size_t(steps.step[i])];
            if (next == PathAutomaton::Dead || (states[next].accepts & light) == 0)
                continue;
            for (int k = 0; k < Wavelengths; k++)
                part[k] += of_state[k] * steps.part[i][k];
        }
    }
}

void PathShares::cast(int ray, int path, const Event& event, int light) {
    const uint64_t bit = m_expressions.class_bit(light);
    const size_t all = m_expressions.automata.size(), at = size_t(ray) * all * Wavelengths;
    if (m_of_ray.size() < at + all * Wavelengths)
        m_of_ray.resize(2 * (at + all * Wavelengths));
    for (size_t e = 0; e < all; e++) {
        Spectrum4 part;
        accepted(e, path, &event, bit, part);
        std::copy_n(part, Wavelengths, m_of_ray.data() + at + e * Wavelengths);
    }
}

void PathShares::add(int path, const Spectrum4& radiance, int light, bool as_diffuse) {
    const uint64_t bit = m_expressions.class_bit(light);
    const Event diffuse(ScatteringEvent<1>::reflected(), 0);
    for (size_t e = 0; e < m_expressions.automata.size(); e++) {
        Spectrum4 part;
        accepted(e, path, as_diffuse ? &diffuse : nullptr, bit, part);
        float* sum = m_radiance.data() + (e * size_t(m_paths) + size_t(path)) * Wavelengths;
        for (int k = 0; k < Wavelengths; k++)
            sum[k] += radiance[k] * part[k];
    }
}

void PathShares::add_ray(int ray, int path, const Spectrum4& radiance) {
    const size_t all = m_expressions.automata.size();
    for (size_t e = 0; e < all; e++) {
        const float* part = m_of_ray.data() + (size_t(ray) * all + e) * Wavelengths;
        float* sum = m_radiance.data() + (e * size_t(m_paths) + size_t(path)) * Wavelengths;
        for (int k = 0; k < Wavelengths; k++)
            sum[k] += radiance[k] * part[k];
    }
}

} // namespace kanuka::transport
