// What light path expressions know of the paths of a batch. A material is a sum of lobes, and a direction of
// it is evaluated for all of them together; so a path is in no one state of an automaton, but in several,
// each with a share of its light in each wavelength. Shares of one path sum to one, so what is split by
// expressions that complement each other sums to the picture.
#pragma once

#include <vector>

#include "base/lanes.h"
#include "bsdf/spectral.h"
#include "transport/path_expression.h"

namespace kanuka::transport {

using bsdf::Spectrum;
using bsdf::Wavelengths;

// How light was scattered at vertices, a lane each.
template <int W>
struct ScatteringEvent {
    Spectrum<W> diffuse;         // the part that diffuse lobes have; the rest is glossy
    Mask<W> transmits, singular; // singular: of one direction, all of it
    bool in_volume;              // then nothing else holds

    static ScatteringEvent reflected() { // diffusely
        return {Spectrum<W>(Float<W>(1.0f)), Mask<W>(false), Mask<W>(false), false};
    }
    static ScatteringEvent of_volume() {
        return {Spectrum<W>(Float<W>(1.0f)), Mask<W>(false), Mask<W>(false), true};
    }
};

class PathShares {
  public:
    using Spectrum4 = float[Wavelengths];
    // Of one lane.
    struct Event {
        Spectrum4 diffuse;
        bool transmits, singular, in_volume;

        template <int W>
        Event(const ScatteringEvent<W>& e, int lane)
            : transmits(e.transmits[lane]), singular(e.singular[lane]), in_volume(e.in_volume) {
            for (int k = 0; k < Wavelengths; k++)
                diffuse[k] = e.diffuse[k][lane];
        }
    };

    // At most so many paths.
    PathShares(const PathExpressions& expressions, int paths);

    void begin(int paths); // at the camera
    void scatter(int path, const Event& event);
    // A shadow ray is cast: what counts for whom if it gets through. event: at the vertex that it leaves.
    void cast(int ray, int path, const Event& event, int light);
    // Light that a path found itself; and if a surface shows it as if it reflected it diffusely.
    void add(int path, const Spectrum4& radiance, int light, bool as_diffuse);
    void add_ray(int ray, int path, const Spectrum4& radiance);

    int count() const { return int(m_expressions.automata.size()); }
    int first_channel() const { return m_expressions.first_channel; }
    // The radiance of an expression: four floats a path.
    const float* radiance(int expression) const {
        return m_radiance.data() + size_t(expression) * size_t(m_paths) * Wavelengths;
    }

  private:
    float* share(size_t state, int path) {
        return m_share.data() + (state * size_t(m_paths) + size_t(path)) * Wavelengths;
    }
    // The part of a path's light that an expression counts.
    void accepted(size_t expression, int path, const Event* event, uint64_t light, Spectrum4& part);

    const PathExpressions& m_expressions;
    int m_paths;
    std::vector<size_t> m_first_state; // of each expression among all
    std::vector<float> m_share, m_radiance;
    std::vector<float> m_of_ray; // ray by ray, grows with them
};

} // namespace kanuka::transport
