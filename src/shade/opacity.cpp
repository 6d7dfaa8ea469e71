#include "shade/opacity.h"

#include <cmath>

namespace kanuka::shade {

namespace {

float presence_of(float r, float g, float b) {
    const float mean = (r + g + b) / 3;
    return std::isfinite(mean) ? std::clamp(mean, 0.0f, 1.0f) : 1.0f;
}

} // namespace

const grid::Channel* find_channel(const grid::Grid& grid, const char* name, int components) {
    for (const grid::Channel& c : grid.primvars)
        if (c.components == components && c.name == name)
            return &c;
    return nullptr;
}

void fill_color(const grid::Grid& grid, const char* name, const Vec3f& constant, grid::SlotValues& out) {
    const grid::Channel* channel = find_channel(grid, name, 3);
    out.uniform = !channel;
    out.value = constant;
    out.data.clear();
    if (!channel)
        return;
    out.data.assign(size_t(grid.stride) * 3, 0.0f);
    for (int c = 0; c < 3; c++)
        std::copy_n(channel->component(c), grid.vertices(),
                    out.data.data() + size_t(c) * size_t(grid.stride));
}

int add_presence_slot(grid::LayeringProgram& program, bool uniform) {
    program.slots.push_back({grid::InputType::Float, grid::Storage::Half, 0, 1, uniform, "presence"});
    return int(program.slots.size()) - 1;
}

void fill_presence(const grid::Grid& grid, const Vec3f& opacity, grid::SlotValues& out) {
    const grid::Channel* channel = find_channel(grid, "Os", 3);
    out.uniform = !channel;
    out.value = {presence_of(opacity.x, opacity.y, opacity.z), 0, 0};
    out.data.clear();
    if (!channel)
        return;
    out.data.assign(size_t(grid.stride), 1.0f);
    for (int i = 0; i < grid.vertices(); i++)
        out.data[size_t(i)] =
            presence_of(channel->component(0)[i], channel->component(1)[i], channel->component(2)[i]);
}

} // namespace kanuka::shade
