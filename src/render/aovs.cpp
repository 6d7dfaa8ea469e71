#include "render/aovs.h"

#include <algorithm>

#include "scene/display_layers.h"
#include "transport/path_expression.h"

namespace kanuka::render {

namespace {
constexpr std::string_view SampleCount = "sample_count";

void check_expression(std::string_view text) {
    try {
        transport::compile_path_expression(text, {});
    } catch (const Error& error) {
        throw Error("the light path expression cannot be read: " + std::string(error.what()), error.code());
    }
}
} // namespace

void Aovs::ask(const std::vector<scene::Display>& displays, const std::vector<std::string>& more) {
    const auto add_all = [&](std::string_view mode, const Location* display) {
        for (const std::string& name : scene::layers_of_mode(mode))
            if (!scene::is_standard_layer(name))
                add(name, display);
    };
    for (const scene::Display& d : displays)
        add_all(d.mode, &d.where);
    for (const std::string& name : more)
        add_all(name, nullptr);
}

void Aovs::add(const std::string& name, const Location* display) {
    if (name == SampleCount) {
        m_layers.sample_count = true;
        return;
    }
    const bool expression = name.starts_with(scene::ExpressionPrefix);
    std::vector<std::string>& list = expression ? m_layers.expressions : m_layers.names;
    const std::string text = expression ? name.substr(scene::ExpressionPrefix.size()) : name;
    if (std::ranges::find(list, text) != list.end())
        return;
    if (expression)
        try {
            check_expression(text);
        } catch (const Error& error) {
            if (!display)
                throw;
            m_faults.push_back({*display, error.what()});
            return;
        }
    list.push_back(text);
}

void check_layer(const std::string& mode) {
    for (const std::string& name : scene::layers_of_mode(mode))
        if (name.starts_with(scene::ExpressionPrefix))
            check_expression(std::string_view(name).substr(scene::ExpressionPrefix.size()));
}

void Aovs::find(const std::vector<grid::LayeringProgram>& programs, const std::string& scene_file,
                Journal& journal) {
    m_layers.kinds.assign(m_layers.names.size(), {});
    for (const grid::LayeringProgram& program : programs)
        for (const grid::Aov& aov : program.aovs)
            if (Layers::Kind& kind = m_layers.kinds[size_t(aov.index)]; kind.components == 0)
                kind = {aov.components, aov.color};
    for (size_t i = 0; i < m_layers.names.size(); i++)
        if (m_layers.kinds[i].components == 0)
            journal.warning({scene_file},
                            "no surface shader has an output parameter \"" + m_layers.names[i] +
                                "\", and no primitive a variable of that name: the picture has no "
                                "such layer. Layers that are always there: rgb, alpha, albedo, N, "
                                "Z, P, id; and if asked for, Pref");
    for (const Fault& fault : m_faults)
        journal.warning(fault.where.file.empty() ? Location{scene_file} : fault.where, fault.what);
}

std::vector<bool> Aovs::is_color() const {
    std::vector<bool> all;
    for (const Layers::Kind& k : m_layers.kinds)
        all.insert(all.end(), 3, k.color);
    all.insert(all.end(), 3 * m_layers.expressions.size(), true);
    return all;
}

size_t Layers::add_channels(film::Picture& picture, size_t pixels) const {
    const size_t first = picture.channels.size();
    for (size_t a = 0; a < kinds.size(); a++)
        for (int c = 0; c < kinds[a].components; c++) {
            const char* const suffix = kinds[a].components == 1 ? "" : kinds[a].color ? "RGB" : "XYZ";
            const std::string name = names[a] + (*suffix ? std::string(".") + suffix[c] : "");
            picture.channels.push_back({name, kinds[a].color, std::vector<float>(pixels)});
        }
    for (const std::string& text : expressions)
        for (const char c : {'R', 'G', 'B'})
            picture.channels.push_back(
                {std::string(scene::ExpressionPrefix) + text + "." + c, true, std::vector<float>(pixels)});
    if (sample_count)
        picture.channels.push_back({std::string(SampleCount), false, std::vector<float>(pixels)});
    return first;
}

void Layers::put(film::Picture& picture, size_t channel, size_t pixel, std::span<const float> sums,
                 const Means& means) const {
    const float* sum = sums.data();
    for (const Kind& kind : kinds) {
        for (int c = 0; c < kind.components; c++)
            picture.channels[channel++].data[pixel] = sum[c] * (kind.color ? means.by_weight : means.by_hits);
        sum += 3;
    }
    for (size_t k = 0; k < 3 * expressions.size(); k++)
        picture.channels[channel++].data[pixel] = sum[k] * means.by_weight * means.exposure;
    if (sample_count)
        picture.channels[channel].data[pixel] = means.samples;
}

} // namespace kanuka::render
