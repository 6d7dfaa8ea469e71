#include "shade/services.h"

#include <algorithm>

#include "shade/point_lights.h"

namespace kanuka::shade {

MaterialServices::MaterialServices(const Spaces& spaces, const Facts& facts, Textures& textures,
                                   Journal& journal, const Location& where, Ranges* ranges)
    : m_spaces(spaces), m_facts(facts), m_textures(textures), m_journal(journal), m_where(where),
      m_ranges(ranges) {}

void MaterialServices::texture(const sl::TextureRequest& request) {
    note_file(request.file);
    m_textures.lookup(request, m_where);
}

void MaterialServices::environment(const sl::TextureRequest& request, const float* x, const float* y,
                                   const float* z) {
    note_file(request.file);
    m_textures.lookup_environment(request, x, y, z, m_where);
}

void MaterialServices::note_file(const char* name) {
    if (name && *name)
        m_read.files.emplace(name);
}

bool MaterialServices::transform(const char* from, const char* to, float matrix[16]) {
    m_read.transforms.emplace(to, from);
    const std::optional<Transform> to_from = m_spaces.to_from(to, from);
    if (!to_from)
        return false;
    for (size_t i = 0; i < 4; i++)
        for (size_t j = 0; j < 4; j++)
            matrix[4 * i + j] = float(to_from->m[i][j]);
    return true;
}

bool MaterialServices::query(const sl::Query& query) {
    m_asked_for_attributes = m_asked_for_attributes || query.kind == sl::Query::Attribute;
    if (query.kind == sl::Query::Texture)
        note_file(query.file);
    return answer(query, m_facts, m_textures);
}

int MaterialServices::lights() {
    return m_facts.lights ? m_facts.lights->count() : 0;
}

void MaterialServices::light(const sl::LightRequest& request) {
    ask(request);
    if (m_wanted && !(*m_wanted)[size_t(request.light)])
        for (float* Cl : request.Cl)
            std::fill_n(Cl, request.count, 0.0f);
}

bool MaterialServices::ask(const sl::LightRequest& request) {
    m_read.world = true;
    return m_facts.lights && m_facts.lights->at(request, m_spaces.current_from_world);
}

void MaterialServices::report(Severity severity, const Location& where, const std::string& message) {
    m_journal.report(severity, where.file.empty() ? m_where : where, message);
}

} // namespace kanuka::shade
