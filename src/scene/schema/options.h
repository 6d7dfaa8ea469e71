// What can be set for the whole picture: scene::Options, a row each.
#pragma once

#include "scene/scene.h"
#include "scene/schema/parameter.h"

namespace kanuka::scene {

using OptionParameter = Parameter<Options>;

std::span<const OptionParameter> option_parameters();
const OptionParameter* find_option(std::string_view name);         // null = there is none
const OptionParameter* find_rib_option(std::string_view rib_name); // "category:name", as Option has it

// Values to go over a scene's options, in order: what a command line or a call says.
class OptionEdits {
  public:
    // Throws Error where the name is unknown or the value cannot be taken.
    void set(std::string_view name, Setting value);
    void set(std::string_view name, double number) { set(name, Setting{{number}, {}}); }
    void set(std::string_view name, std::string text) { set(name, Setting{{}, {std::move(text)}}); }
    bool has(std::string_view name) const;
    void apply(Options& to) const;

  private:
    std::vector<std::pair<const OptionParameter*, Setting>> m_edits;
};

} // namespace kanuka::scene
