#include "render/aovs.h"

#include <algorithm>

#include "scene/display_layers.h"

namespace kanuka::render {

void Aovs::ask(const std::vector<scene::Display>& displays, const std::vector<std::string>& more) {
    const auto add = [&](std::string_view mode) {
        for (const std::string& name : scene::layers_of_mode(mode))
            if (!scene::is_standard_layer(name) &&
                std::find(m_names.begin(), m_names.end(), name) == m_names.end())
                m_names.push_back(name);
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
            journal.warning({scene_file},
                            "no surface shader has an output parameter \"" + m_names[i] +
                                "\", and no primitive a variable of that name: the picture has no "
                                "such layer. Layers that are always there: rgb, alpha, albedo, N, "
                                "Z, P, id; and if asked for, Pref");
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
