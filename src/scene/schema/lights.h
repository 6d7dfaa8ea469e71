// The kinds of lights, and what can be set of each: a row each. add_light() of Python, the light shaders of
// RIB and their manual derive from these tables.
#pragma once

#include "scene/scene.h"
#include "scene/schema/parameter.h"

namespace kanuka::scene {

// A light as it is described: what is set, before it has its place and its tables.
struct LightSettings {
    Light light;
    Vec3f position{0, 0, 0}, direction{0, 0, -1};
    Vec3f sun{0.3f, 0.6f, 0.2f}; // towards it; +y is the zenith
    float turbidity = 3;
    int decay = 2; // the power of the distance that it falls off with
};

struct LightKind {
    const char* name;
    const char* shader; // of RIB
    Light::Kind kind;
    const char* amount; // the quantity that it is
    const char* about;
    bool daylight = false;          // it has a sun
    const char* mapped_shader = ""; // of RIB: the same with the parameters of a shadow map

    LightSettings defaults() const;
    // In RIB it stands at "from" and shines to "to".
    bool is_placed_by_points() const;
    std::vector<std::string_view> shader_parameters() const; // all names that its light shader takes
};
// What a light is made from, kept so that it can be made again with other values.
struct LightSource {
    const LightKind* kind;
    LightSettings settings;
    Transform placement; // in the world, after position and direction
    Light (*finish)(const LightSource& source);
};
// The light that it describes now; the node stays.
void remake(Light& light, LightSource source);

std::span<const LightKind> light_kinds();
const LightKind* find_light_kind(std::string_view name);   // null = there is none
const LightKind* find_light_shader(std::string_view name); // by either of its shaders

class LightParameter : public Parameter<LightSettings> {
  public:
    LightParameter(uint32_t kinds, const ParameterText& text, const Place<LightSettings>& at)
        : Parameter(text, at), m_kinds(kinds) {}
    // ParameterText::rib names parameters of LightKind::shader.
    bool is_of(const LightKind& kind) const { return m_kinds >> (&kind - light_kinds().data()) & 1; }

  private:
    uint32_t m_kinds;
};
std::span<const LightParameter> light_parameters();
const LightParameter* find_light_parameter(std::string_view name);

} // namespace kanuka::scene
