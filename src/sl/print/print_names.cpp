// Names that all listings share.
#include "sl/print/print.h"

namespace kanuka::sl {

using namespace ir;

std::string source_line(const Sources& sources, Loc at) {
    std::string_view line = sources.line(at);
    const size_t first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos)
        return {};
    line = line.substr(first, 140);
    while (!line.empty() &&
           (line.back() == '\\' || line.back() == ' ')) // would join the next line to a comment
        line.remove_suffix(1);
    std::string_view file = sources.name(at.file);
    file.remove_prefix(file.rfind('/') == std::string_view::npos ? 0 : file.rfind('/') + 1);
    return std::string(file) + ":" + std::to_string(at.line) + ": " + std::string(line);
}

std::string_view call_name(CallKind kind) {
    static constexpr std::string_view Names[] = {"difference_u",
                                                 "difference_v",
                                                 "calculatenormal",
                                                 "texture",
                                                 "environment",
                                                 "space_matrix",
                                                 "printf",
                                                 "format",
                                                 "concat",
                                                 "match",
                                                 "report",
                                                 "found",
                                                 "query",
                                                 "lights",
                                                 "light_direction",
                                                 "light_color",
                                                 "CreateBoundary",
                                                 "AddLobe",
                                                 "AddLayer",
                                                 "CreateInterior",
                                                 "AddPhaseFunction",
                                                 "SetPhaseFunction",
                                                 "SetAbsorption",
                                                 "SetScattering",
                                                 "SetPriority"};
    static_assert(std::size(Names) == size_t(CallKind::SetPriority) + 1);
    return size_t(kind) < std::size(Names) ? Names[size_t(kind)] : "call";
}

std::string channel_name(const Program& program, int channel) {
    const Channel& c = program.channels[size_t(channel)];
    if (c.presence)
        return "presence";
    if (c.ambient)
        return "ambient";
    if (c.opacity >= 0)
        return "opacity[" + std::to_string(int(c.opacity)) + "]";
    return c.node + "." +
           (c.input < 0 ? "weight" : std::string(grid::lobe(c.lobe).inputs[size_t(c.input)].name));
}

std::string parameter_name(const Program& program, const Instr& i) {
    const std::string& name = program.parameters[size_t(i.imm)].name;
    if (i.floats.empty())
        return name;
    return i.floats.size() > 1 ? "length(" + name + ")" : name + "[" + std::to_string(int(i.floats[0])) + "]";
}

std::string output_name(const Program& program, const Output& o) {
    static constexpr const char* Emissions[] = {"Cl", "form", "from", "axis", "angle"};
    static constexpr const char* Filtered[] = {"Ci", "Oi", "alpha"};
    static_assert(std::size(Emissions) == size_t(ir::Emission::Count));
    switch (o.kind) {
    case Output::Position:
        return "result.P";
    case Output::Normal:
        return "result.N";
    case Output::Slot:
        return channel_name(program, o.index);
    case Output::Member:
        return "result.member" + std::to_string(o.index);
    case Output::Emitted:
        return std::string("result.") +
               Emissions[std::min<size_t>(size_t(o.index), std::size(Emissions) - 1)];
    case Output::Filtered:
        return std::string("result.") + Filtered[std::min<size_t>(size_t(o.index), std::size(Filtered) - 1)];
    default:
        return "result." + program.parameters[size_t(o.index)].name +
               (o.element ? "[" + std::to_string(o.element) + "]" : "");
    }
}

} // namespace kanuka::sl
