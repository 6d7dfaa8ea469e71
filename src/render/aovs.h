// Layers of the picture beside those that it always has, as displays and callers ask for them: output
// variables of surface shaders, variables of primitives, and what light path expressions count.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "film/film.h"
#include "grid/layering.h"
#include "scene/scene.h"

namespace kanuka::render {

// Those that have sums, as pictures have them.
struct Layers {
    struct Kind {
        int components = 0; // 0 = nothing has it
        bool color = false;
    };
    std::vector<std::string> names;       // of output variables
    std::vector<Kind> kinds;              // parallel to them
    std::vector<std::string> expressions; // light path expressions that can be read; without "lpe:"
    bool sample_count = false;            // a layer of its own

    size_t count() const { return names.size() + expressions.size(); }
    // Channels foo (floats), foo.R … (colours), foo.X … (the rest); returns the number of the first.
    size_t add_channels(film::Picture& picture, size_t pixels) const;
    struct Means { // what sums are multiplied with to be means
        float by_weight, by_hits;
        float exposure; // the picture's, which light has as well
        float samples;
    };
    // sums: of the pixel, three a layer.
    void put(film::Picture& picture, size_t first_channel, size_t pixel, std::span<const float> sums,
             const Means& means) const;
};

class Aovs {
  public:
    // A display's mode names one or several, as "foo", "varying color foo", "foo,bar" or "lpe:C<RD>L"; the
    // layers that every picture has are not asked for again. An expression that cannot be read is reported
    // by find() where its Display stands; among `more` it is an Error.
    void ask(const std::vector<scene::Display>& displays, const std::vector<std::string>& more);
    const Layers& layers() const { return m_layers; }
    const std::vector<std::string>& names() const { return m_layers.names; }
    const std::vector<std::string>& expressions() const { return m_layers.expressions; }
    size_t count() const { return m_layers.count(); } // of layers that have sums

    // What variables are is what the first material that has them says. Names that none has are reported, and
    // expressions that cannot be read.
    void find(const std::vector<grid::LayeringProgram>& programs, const std::string& scene_file,
              Journal& journal);
    // Three values each, variables first, as transport::SceneView has them.
    std::vector<bool> is_color() const;

  private:
    void add(const std::string& name, const Location* display);

    Layers m_layers;
    struct Fault { // of an expression
        Location where;
        std::string what;
    };
    std::vector<Fault> m_faults;
};

// What is wrong with a layer that a caller asks for, as far as its name tells: Error of ExitCode::Usage.
void check_layer(const std::string& name);

} // namespace kanuka::render
