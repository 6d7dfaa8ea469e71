// Output variables of surface shaders, and variables of primitives, that become layers of the picture: which
// are asked for, what they are, and how their sums become channels.
#pragma once

#include <string>
#include <vector>

#include "base/error.h"
#include "film/film.h"
#include "grid/layering.h"
#include "scene/scene.h"

namespace kanuka::render {

class Aovs {
  public:
    // A display's mode names one or several, as "foo", "varying color foo", or "foo,bar"; the layers that
    // every picture has are not asked for again.
    void ask(const std::vector<scene::Display>& displays, const std::vector<std::string>& more);
    const std::vector<std::string>& names() const { return m_names; }

    // What they are is what the first material that has them says. Names that none has are reported.
    void find(const std::vector<grid::LayeringProgram>& programs, const std::string& scene_file,
              Journal& journal);
    // Three values each, as transport::SceneView has them.
    std::vector<bool> is_color() const;

    // Channels foo (floats), foo.R … (colours), foo.X … (the rest); returns the number of the first.
    size_t add_channels(film::Picture& picture, size_t pixels) const;
    // by_weight, by_hits: what sums are multiplied with to be means.
    void put(film::Picture& picture, size_t first_channel, size_t pixel, const std::vector<float>& sums,
             float by_weight, float by_hits) const;

  private:
    struct Kind {
        int components = 0; // 0 = nothing has it
        bool color = false;
    };
    std::vector<std::string> m_names;
    std::vector<Kind> m_kinds; // parallel to the names
};

} // namespace kanuka::render
