// Layers of the picture beside those that it always has, as displays and callers ask for them: output
// variables of surface shaders, variables of primitives, and what light path expressions count.
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
    // A display's mode names one or several, as "foo", "varying color foo", "foo,bar" or "lpe:C<RD>L"; the
    // layers that every picture has are not asked for again. An expression that cannot be read is reported
    // by find() where its Display stands; among `more` it is an Error.
    void ask(const std::vector<scene::Display>& displays, const std::vector<std::string>& more);
    const std::vector<std::string>& names() const { return m_names; } // of output variables
    // Light path expressions that can be read; without "lpe:".
    const std::vector<std::string>& expressions() const { return m_expressions; }
    size_t count() const { return m_names.size() + m_expressions.size(); } // of layers that have sums

    // What variables are is what the first material that has them says. Names that none has are reported, and
    // expressions that cannot be read.
    void find(const std::vector<grid::LayeringProgram>& programs, const std::string& scene_file,
              Journal& journal);
    // Three values each, variables first, as transport::SceneView has them.
    std::vector<bool> is_color() const;

    // Channels foo (floats), foo.R … (colours), foo.X … (the rest); returns the number of the first.
    size_t add_channels(film::Picture& picture, size_t pixels) const;
    struct Means { // what sums are multiplied with to be means
        float by_weight, by_hits;
        float exposure; // the picture's, which light has as well
        float samples;
    };
    void put(film::Picture& picture, size_t first_channel, size_t pixel, const std::vector<float>& sums,
             const Means& means) const;

  private:
    struct Kind {
        int components = 0; // 0 = nothing has it
        bool color = false;
    };
    void add(const std::string& name, const Location* display);

    std::vector<std::string> m_names, m_expressions;
    struct Fault { // of an expression
        Location where;
        std::string what;
    };
    std::vector<Fault> m_faults;
    bool m_sample_count = false; // a layer of its own
    std::vector<Kind> m_kinds;   // parallel to the names
};

// What is wrong with a layer that a caller asks for, as far as its name tells: Error of ExitCode::Usage.
void check_layer(const std::string& name);

} // namespace kanuka::render
