#include "shade/atmosphere.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kanuka::shade {

namespace {

using grid::InputType, grid::Storage;

// Ci and Oi reach a volume shader as the globals Cs and Os, unless the grid has such primvars: those are the
// surface's, and hidden while it runs.
class HiddenColors {
  public:
    explicit HiddenColors(grid::Grid& grid) {
        for (grid::Channel& c : grid.primvars)
            if (c.name == "Cs" || c.name == "Os") {
                m_hidden.emplace_back(&c, c.name);
                c.name.clear();
            }
    }
    ~HiddenColors() {
        for (auto& [channel, name] : m_hidden)
            channel->name = name;
    }
    HiddenColors(const HiddenColors&) = delete;

  private:
    std::vector<std::pair<grid::Channel*, std::string>> m_hidden;
};

// Some vertices of a grid, as one without neighbours.
grid::Grid sample(const grid::Grid& grid, int count) {
    const int n = std::min(count, grid.vertices());
    grid::Grid s;
    s.allocate(n - 1, 0);
    s.facets = grid.facets;
    const auto vertex = [&](int i) { return n > 1 ? int(int64_t(grid.vertices() - 1) * i / (n - 1)) : 0; };
    const auto take = [&](const std::vector<float>& from, int stride, std::vector<float>& to,
                          int components) {
        if (from.size() < size_t(components) * size_t(stride))
            return;
        for (int c = 0; c < components; c++)
            for (int i = 0; i < n; i++)
                to[size_t(c) * size_t(s.stride) + size_t(i)] =
                    from[size_t(c) * size_t(stride) + size_t(vertex(i))];
    };
    using Member = std::vector<float> grid::Grid::*;
    for (const Member m :
         {&grid::Grid::P, &grid::Grid::N, &grid::Grid::Ng, &grid::Grid::dPdu, &grid::Grid::dPdv})
        take(grid.*m, grid.stride, s.*m, 3);
    for (const Member m : {&grid::Grid::u, &grid::Grid::v, &grid::Grid::s, &grid::Grid::t})
        take(grid.*m, grid.stride, s.*m, 1);
    for (const grid::Channel& c : grid.primvars) {
        grid::Channel channel{c.name, c.components, s.stride,
                              std::vector<float>(size_t(c.components) * size_t(s.stride) + 32, 0.0f)};
        take(c.data, c.stride, channel.data, c.components);
        s.primvars.push_back(std::move(channel));
    }
    return s;
}

sl::Filtered run(const sl::Instance& shader, grid::Grid& grid, sl::GridGlobals globals, const Rgb& Ci,
                 sl::Services& services) {
    globals.Cs = Ci;
    globals.Os = Rgb(1);
    return shader.filter(grid, globals, services);
}

// Is the colour between black and white where a line would have it? Each component by itself, so that a
// filter that mixes them is found too.
bool is_line(const sl::Instance& shader, const grid::Grid& grid, const sl::GridGlobals& globals,
             sl::Services& services) {
    grid::Grid points = sample(grid, 16);
    const Rgb between(0.2f, 0.5f, 0.7f);
    const sl::Filtered black = run(shader, points, globals, Rgb(0), services),
                       white = run(shader, points, globals, Rgb(1), services),
                       third = run(shader, points, globals, between, services);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < points.vertices(); i++) {
            const size_t at = size_t(c) * size_t(points.stride) + size_t(i);
            const float a = black.Ci[at], b = white.Ci[at], expected = a + (b - a) * between[c];
            if (std::abs(third.Ci[at] - expected) > 2e-3f * (std::abs(a) + std::abs(b)) + 1e-5f)
                return false;
        }
    return true;
}

} // namespace

void add_atmosphere(grid::LayeringProgram& program) {
    const auto add = [&](Storage storage, float high, const char* name) {
        program.slots.push_back({InputType::Color, storage, 0, high, false, name});
        return int(program.slots.size()) - 1;
    };
    program.atmosphere.filter = add(Storage::Color, 1, "atmosphere.filter");
    program.atmosphere.glow = add(Storage::Amount, std::numeric_limits<float>::infinity(), "atmosphere.glow");
}

void fill_atmosphere(const sl::Instance& shader, grid::Grid& grid, const sl::GridGlobals& globals,
                     sl::Services& services, const Location& where, const grid::LayeringProgram& program,
                     grid::VertexInputs& out) {
    const HiddenColors hidden(grid);
    if (!is_line(shader, grid, globals, services))
        services.report(Severity::Warning, where,
                        "volume shader \"" + shader.shader().name() +
                            "\" does more to Ci than scale its components and add to them; what it does to "
                            "black and to white is taken for all colours");
    sl::Filtered black = run(shader, grid, globals, Rgb(0), services);
    const sl::Filtered white = run(shader, grid, globals, Rgb(1), services);
    grid::SlotValues& filter = out.slots[size_t(program.atmosphere.filter)];
    grid::SlotValues& glow = out.slots[size_t(program.atmosphere.glow)];
    filter.uniform = glow.uniform = false;
    filter.data.resize(3 * size_t(grid.stride));
    for (size_t i = 0; i < filter.data.size(); i++)
        filter.data[i] = white.Ci[i] - black.Ci[i];
    black.Ci.resize(filter.data.size());
    glow.data = std::move(black.Ci);
}

} // namespace kanuka::shade
