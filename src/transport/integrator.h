// Integrators: what becomes of paths between generation and film. One file each in integrators/; the build
// makes the list of them from that folder. docs/integrators.md walks through one.
//
//     namespace kanuka::transport::NAME {                      // the file is integrators/NAME.h
//     inline constexpr IntegratorInfo info{"what it does", {{"distance", 1, "what it means"}}};
//     template <int W> struct Integrator {
//         explicit Integrator(const IntegratorValues& values);  // as declared in info
//         void trace(Tracer<W>& tracer);                        // a batch of camera rays, generated already
//     };
//     }
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

namespace kanuka::transport {

struct IntegratorParameter {
    std::string_view name;
    float fallback;
    std::string_view help;
};

struct IntegratorInfo {
    std::string_view help;
    std::array<IntegratorParameter, 4> parameters = {}; // up to the first without a name
};

using IntegratorValues = std::array<float, 4>;

// An integrator with its values, as users write it: "ao", "ao:distance=2,…".
struct IntegratorChoice {
    std::string_view name = "path"; // of the table of integrators
    IntegratorValues values{};

    // Throws Error that says what there is.
    static IntegratorChoice parse(std::string_view text);
};

struct NamedIntegrator {
    std::string_view name;
    const IntegratorInfo* info;
};
std::span<const NamedIntegrator> integrators(); // path first, then by name

} // namespace kanuka::transport
