#include "transport/kernel.h"

#include <algorithm>
#include <charconv>

#include "base/cpu.h"
#include "base/error.h"
#include "transport/integrator_table.h"

namespace kanuka::transport {

namespace {

const IntegratorRow& row_of(std::string_view name) {
    std::string list;
    for (const IntegratorRow& row : integrator_table()) {
        if (row.name == name)
            return row;
        list += (list.empty() ? "" : ", ") + std::string(row.name);
    }
    throw Error("unknown integrator \"" + std::string(name) + "\"; there are " + list, ExitCode::Usage);
}

// "distance=2" of "ao:distance=2"
void read_value(const IntegratorRow& row, std::string_view setting, IntegratorValues& values) {
    const size_t equals = std::min(setting.find('='), setting.size());
    const std::string_view name = setting.substr(0, equals);
    std::string known;
    for (size_t k = 0; k < values.size() && !row.info->parameters[k].name.empty(); k++) {
        const IntegratorParameter& p = row.info->parameters[k];
        known += (known.empty() ? "" : ", ") + std::string(p.name);
        if (p.name != name)
            continue;
        const char* end = setting.data() + setting.size();
        const auto read = std::from_chars(std::min(setting.data() + equals + 1, end), end, values[k]);
        if (read.ec != std::errc() || read.ptr != end)
            throw Error("\"" + std::string(setting) + "\" is no setting of the integrator " +
                            std::string(row.name) + "; write " + std::string(name) + "=NUMBER",
                        ExitCode::Usage);
        return;
    }
    throw Error("the integrator " + std::string(row.name) + " has no parameter \"" + std::string(name) +
                    "\"; " + (known.empty() ? "it has none" : "there are " + known),
                ExitCode::Usage);
}

} // namespace

std::span<const NamedIntegrator> integrators() {
    static const std::vector<NamedIntegrator> all = [] {
        std::vector<NamedIntegrator> list;
        for (const IntegratorRow& row : integrator_table())
            list.push_back({row.name, row.info});
        return list;
    }();
    return all;
}

IntegratorChoice IntegratorChoice::parse(std::string_view text) {
    const size_t colon = std::min(text.find(':'), text.size());
    const IntegratorRow& row = row_of(text.substr(0, colon));
    IntegratorChoice choice{row.name, {}};
    for (size_t k = 0; k < choice.values.size(); k++)
        choice.values[k] = row.info->parameters[k].fallback;
    text.remove_prefix(std::min(colon + 1, text.size()));
    while (!text.empty()) {
        const size_t comma = std::min(text.find(','), text.size());
        read_value(row, text.substr(0, comma), choice.values);
        text.remove_prefix(std::min(comma + 1, text.size()));
    }
    return choice;
}

// Sixteen are there for who asks: without AVX-512 they run as pairs of registers, and with it they gain
// nothing over eight that are compiled for it, too.
int widest_lanes() {
    return 8;
}

std::unique_ptr<Kernel> make_kernel(const SceneView& scene, int lanes) {
    const IntegratorRow& row = row_of(scene.settings.integrator.name);
    if (lanes == 0)
        lanes = widest_lanes();
    if (lanes != 1 && lanes != 8 && lanes != 16)
        throw Error("lanes must be 1, 8 or 16", ExitCode::Usage);
    const auto either = [](auto a, auto b) { return a ? a : b; };
    const auto sixteen = has_avx512() ? row.w16_avx512 : row.w16;
    const auto eight = either(has_avx512() ? row.w8_avx512 : nullptr, either(row.w8, row.w1));
    const auto make = either(lanes == 1 ? row.w1 : lanes == 16 ? sixteen : nullptr, eight);
    return make(scene, scene.settings.integrator.values);
}

} // namespace kanuka::transport
