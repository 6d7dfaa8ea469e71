// What a running shader asks for, answered for one primitive. Made for one call; keeps references alone.
#pragma once

#include "shade/query.h"
#include "shade/ranges.h"
#include "shade/spaces.h"
#include "shade/textures.h"
#include "sl/sl.h"

namespace kanuka::shade {

class MaterialServices : public sl::Services {
  public:
    MaterialServices(const Spaces& spaces, const Facts& facts, Textures& textures, Journal& journal,
                     const Location& where, Ranges* ranges = nullptr);
    void texture(const sl::TextureRequest& request) override;
    void environment(const sl::TextureRequest& request, const float* x, const float* y,
                     const float* z) override;
    bool transform(const char* from, const char* to, float matrix[16]) override;
    bool query(const sl::Query& query) override;
    int lights() override;
    void light(const sl::LightRequest& request) override;
    void out_of_range(const sl::OutOfRange& what) override {
        if (m_ranges)
            m_ranges->add(what, m_where);
    }
    void report(Severity severity, const Location& where, const std::string& message) override;

    // From now on lights that are not wanted are dark. Null = all are wanted.
    void want_lights(const std::vector<bool>* wanted) { m_wanted = wanted; }

    // So far.
    const SpacesRead& read() const { return m_read; }
    // True once a shader asked for the primitive's attributes.
    bool asked_for_attributes() const { return m_asked_for_attributes; }

  protected:
    bool ask(const sl::LightRequest& request); // PointLights::at()

  private:
    void note_file(const char* name);

    const Spaces& m_spaces;
    const Facts& m_facts;
    Textures& m_textures;
    Journal& m_journal;
    const Location& m_where; // of the shader in the scene
    Ranges* m_ranges;
    const std::vector<bool>* m_wanted = nullptr;
    SpacesRead m_read;
    bool m_asked_for_attributes = false;
};

} // namespace kanuka::shade
