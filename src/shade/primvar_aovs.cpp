#include "shade/primvar_aovs.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "shade/arguments.h"
#include "shade/opacity.h"

namespace kanuka::shade {

namespace {

using scene::Type;

constexpr std::string_view Reference[] = {"Pref", "__Pref"};
// What grids have no channel of their own for.
constexpr std::string_view NoChannel[] = {"P", "Pw", "Pz", "N",     "Np",
                                          "s", "t",  "st", "width", "constantwidth"};

bool is_one_of(std::span<const std::string_view> names, std::string_view name) {
    return std::ranges::find(names, name) != names.end();
}

// Fills in all but the index; false = this is no variable that a layer can show.
bool describe(const scene::Value& v, PrimvarAov& aov) {
    aov.name = v.name;
    aov.type = v.type;
    aov.components = scene::components(v.type) * v.array_size;
    if (v.type == Type::String || aov.components < 1 || aov.components > 3 || is_one_of(NoChannel, v.name))
        return false;
    aov.varying = !is_constant(v);
    if (aov.varying)
        return true;
    for (int c = 0; c < aov.components; c++) {
        const bool whole = v.type == Type::Integer;
        if (size_t(c) >= (whole ? v.ints.size() : v.floats.size()))
            return false;
        aov.value[c] = whole ? float(v.ints[size_t(c)]) : v.floats[size_t(c)];
    }
    return true;
}

} // namespace

std::vector<PrimvarAov> primvar_aovs(const scene::Primitive& primitive, std::span<const std::string> wanted) {
    std::vector<PrimvarAov> found;
    for (size_t i = 0; i < wanted.size(); i++) {
        PrimvarAov aov{.index = int(i)};
        const auto has = [&](std::string_view name) {
            const scene::Value* v = primitive.primvars.find(name);
            return v && describe(*v, aov);
        };
        const bool reference = is_one_of(Reference, wanted[i]);
        if (!has(wanted[i]) && !(reference && std::ranges::any_of(Reference, has))) {
            if (!reference)
                continue;
            aov = {.index = int(i), .type = Type::Point, .components = 3, .varying = true};
        }
        found.push_back(aov);
    }
    return found;
}

void add_aov(grid::LayeringProgram& program, int index, const std::string& name, Type type, int components) {
    constexpr float Most = std::numeric_limits<float>::max();
    grid::Aov aov;
    aov.index = index;
    aov.color = type == Type::Color;
    aov.components = std::min(components, 3);
    for (int c = 0; c < aov.components; c++) {
        aov.slots[size_t(c)] = int(program.slots.size());
        program.slots.push_back(
            {grid::InputType::Float, grid::Storage::Full, -Most, Most, false, "aov." + name});
    }
    program.aovs.push_back(aov);
}

void fill_primvar_aov(const PrimvarAov& aov, const grid::Aov& slots, const grid::Grid& grid,
                      const Transform& current_from_object, grid::VertexInputs& out) {
    const grid::Channel* channel =
        aov.name.empty() ? nullptr : find_channel(grid, aov.name.c_str(), aov.components);
    const bool varies =
        aov.varying && (channel || aov.name.empty()); // a variable too short has been left out
    const size_t stride = size_t(grid.stride);
    std::array<std::vector<float>*, 3> data{};
    for (int c = 0; c < aov.components; c++) {
        grid::SlotValues& slot = out.slots[size_t(slots.slots[size_t(c)])];
        slot.uniform = !varies;
        slot.value = {aov.value[c], 0, 0};
        slot.data.assign(varies ? stride : 0, 0.0f);
        data[size_t(c)] = &slot.data;
    }
    if (!varies)
        return;
    const auto component = [&](int c) {
        return channel ? channel->component(c) : grid.P.data() + size_t(c) * stride;
    };
    if (aov.components < 3 ||
        (aov.type != Type::Point && aov.type != Type::Vector && aov.type != Type::Normal)) {
        for (int c = 0; c < aov.components; c++)
            std::copy_n(component(c), grid.vertices(), data[size_t(c)]->begin());
        return;
    }
    // What is flattened cannot be taken back.
    const Transform object_from_current =
        current_from_object.determinant3() != 0 ? current_from_object.inverse() : Transform();
    for (int i = 0; i < grid.vertices(); i++) {
        const Vec3f v(component(0)[i], component(1)[i], component(2)[i]);
        const Vec3f own = aov.type == Type::Point    ? object_from_current.point(v)
                          : aov.type == Type::Vector ? object_from_current.vector(v)
                                                     : object_from_current.normal(v, current_from_object);
        for (int c = 0; c < 3; c++)
            (*data[size_t(c)])[size_t(i)] = own[c];
    }
}

} // namespace kanuka::shade
