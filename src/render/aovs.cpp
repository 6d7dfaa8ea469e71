#include "render/aovs.h"

#include <algorithm>

namespace kanuka::render {

namespace {

// Modes of displays that are no names of output variables, and the layers that are always there.
constexpr std::string_view Known[] = {"rgb", "rgba", "rgbz", "rgbaz", "r",     "g",      "b", "a", "z",  "Z",
                                      "az",  "Ci",   "Oi",   "Ci,Oi", "alpha", "albedo", "N", "P", "id", ""};

// The last word of a declaration is the name.
std::string name_of(std::string_view declaration) {
    const size_t end = declaration.find_last_not_of(" \t\n");
    if (end == std::string_view::npos)
        return "";
    const size_t space = declaration.find_last_of(" \t\n", end);
    const size_t begin = space == std::string_view::npos ? 0 : space + 1;
    return std::string(declaration.substr(begin, end + 1 - begin));
}

} // namespace

void Aovs::ask(const std::vector<scene::Display>& displays, const std::vector<std::string>& more) {
    const auto add = [&](std::string_view list) {
        while (true) {
            const size_t comma = list.find(',');
            const std::string name = name_of(list.substr(0, comma));
            if (std::find(std::begin(Known), std::end(Known), name) == std::end(Known) &&
                std::find(m_names.begin(), m_names.end(), name) == m_names.end())
                m_names.push_back(name);
            if (comma == std::string_view::npos)
                return;
            list.remove_prefix(comma + 1);
        }
    };
    for (const scene::Display& d : displays)
        add(d.mode);
    for (const std::string& name : more)
        add(name);
}

void Aovs::find(const std::vector<grid::LayeringProgram>& programs, const std::string& scene_file,
                Journal& journal) {
    m_kinds.assign(m_names.size(), {});
    for (const grid::LayeringProgram& program : programs)
        for (const grid::Aov& aov : program.aovs)
            if (Kind& kind = m_kinds[size_t(aov.index)]; kind.components == 0)
                kind = {aov.components, aov.color};
    for (size_t i = 0; i < m_names.size(); i++)
        if (m_kinds[i].components == 0)
            journal.warning({scene_file}, "no surface shader has an output parameter \"" + m_names[i] +
                                              "\": the picture has no such layer. Layers that are always "
                                              "there: rgb, alpha, albedo, N, Z, P, id");
}

std::vector<bool> Aovs::is_color() const {
    std::vector<bool> all;
    for (const Kind& k : m_kinds)
        all.insert(all.end(), 3, k.color);
    return all;
}

size_t Aovs::add_channels(film::Picture& picture, size_t pixels) const {
    const size_t first = picture.channels.size();
    for (size_t a = 0; a < m_kinds.size(); a++)
        for (int c = 0; c < m_kinds[a].components; c++) {
            const char* const suffix = m_kinds[a].components == 1 ? "" : m_kinds[a].color ? "RGB" : "XYZ";
            const std::string name = m_names[a] + (*suffix ? std::string(".") + suffix[c] : "");
            picture.channels.push_back({name, m_kinds[a].color, std::vector<float>(pixels)});
        }
    return first;
}

void Aovs::put(film::Picture& picture, size_t channel, size_t pixel, const std::vector<float>& sums,
               float by_weight, float by_hits) const {
    const size_t stride = 3 * m_kinds.size();
    for (size_t a = 0; a < m_kinds.size(); a++)
        for (int c = 0; c < m_kinds[a].components; c++)
            picture.channels[channel++].data[pixel] =
                sums[pixel * stride + 3 * a + size_t(c)] * (m_kinds[a].color ? by_weight : by_hits);
}

} // namespace kanuka::render
