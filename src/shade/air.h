// Air: a volume shader run along straight ways, whenever a ray has found where it ends.
#pragma once

#include <memory>

#include "grid/ways.h"
#include "shade/point_lights.h"
#include "shade/services.h"
#include "shade/shade.h"

namespace kanuka::shade {

class AirOfShader {
  public:
    // `spaces`: what the shader calls object and shader space; where = in the scene.
    AirOfShader(std::shared_ptr<const sl::Shader> shader, std::span<const sl::Argument> arguments,
                const Spaces& spaces, const Facts& facts, Textures& textures, Journal& journal,
                const Location& where, std::shared_ptr<const scene::Attributes> attributes);

    // Runs the shader for black and for white things at the far ends: two points of a line.
    void look(grid::Ways& ways, AirLights* lights) const;
    // Reports a shader that is no line: found by a third colour.
    void check(grid::Ways& ways) const;

  private:
    sl::Filtered run(const grid::Ways& ways, std::span<const Rgb> shown, AirLights* lights) const;

    Spaces m_spaces;
    Facts m_facts;
    std::shared_ptr<const scene::Attributes> m_attributes; // keeps what facts point at
    Textures& m_textures;
    Journal& m_journal;
    Location m_where;
    std::shared_ptr<const sl::Shader> m_shader; // keeps the instance's code alive
    std::unique_ptr<sl::Instance> m_instance;
};

} // namespace kanuka::shade
