// What the binding sources share. Each bind_* adds its classes to the module; module.cpp calls them in order.
#pragma once

#include <memory>
#include <unordered_map>

#include <nanobind/nanobind.h>
// In every source alike: a type converted differently in two of them would break the one-definition rule.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>

#include "base/error.h"
#include "base/stats.h"
#include "color/color.h"
#include "film/film.h"
#include "ingest/rib/dialects/lights.h"
#include "ingest/rib/expansions.h"
#include "python/string_caster.h"
#include "scene/delayed.h"
#include "scene/editor.h"

namespace kanuka::python {

namespace nb = nanobind;

// A material as Python gives it: shaders, and the attributes that belong to looks.
struct Material {
    scene::ShaderRef surface;
    std::optional<scene::ShaderRef> displacement;
    float displacement_bound = 0;
    Rgb color{1, 1, 1}, opacity{1, 1, 1};
    std::string color_spectrum; // in place of color
};

// A spectrum as Python gives it: by the text that scenes name it with.
struct Spectrum {
    std::string text;
    color::Table table;
};
// Of a str or a Spectrum; throws for others, with the argument's name.
std::string spectrum_text(nb::handle value, const char* name);

// A camera, with its field of view as it was given: which side of the picture it spans is known only once the
// picture's size is.
struct Camera {
    enum class FovAxis { Smaller, X, Y };
    scene::Camera camera;
    FovAxis axis = FovAxis::Smaller;
    scene::Camera resolve(const scene::Options& options, int width, int height) const;
};

// A scene under construction, or read from a file. Members are written with the interpreter's lock held.
struct Scene {
    scene::Scene scene;       // a render reads it without the lock, and nothing may write it then:
    bool is_rendered = false; // see check_idle()
    scene::Options options;   // those of the next render
    Camera camera;
    std::optional<scene::Editor>
        editor; // whatever is added or changed goes through it, options and camera too
    bool repeat_is_told = false;
    std::shared_ptr<Journal> journal = std::make_shared<Journal>(); // what reading it reported
    std::shared_ptr<scene::Delayed> delayed; // procedurals that wait; they report to the journal
    std::shared_ptr<ingest::Expansions::Frame> expansions; // of a shot that it is a frame of; null = none
    double ingest_s = 0;
    int next_id = 1;
    std::unordered_map<int64_t, scene::NodeId> numbers; // of primitives, as far as somebody asked for one

    Scene() { begin_editing(); }
    // Of what is there now.
    void begin_editing() {
        editor.emplace(scene, options, camera.camera);
        editor->choose_stand_ins(&ingest::dialects::stand_in_for_light);
        if (delayed)
            editor->keep_groups();
    }
};

// Scene.procedurals_shared (load.cpp).
nb::dict shared_of(const Scene& scene);

// Throws where a render reads the scene.
inline void check_idle(const Scene& scene) {
    if (scene.is_rendered)
        throw std::runtime_error("the scene is being rendered: add to it before or after, or to another one");
}

// After something was added: a name that is given twice is told of once.
inline void tell_of_repeat(Scene& scene) {
    const auto& repeat = scene.editor->repeat();
    if (repeat && !scene.repeat_is_told)
        scene.journal->report(Severity::Info, repeat->where, repeat->message());
    scene.repeat_is_told = repeat.has_value();
}

// A group of a scene; instances of it are added to the scene or to later groups.
struct Group {
    std::shared_ptr<Scene> owner;
    scene::NodeId id;
    scene::Group& get() const {
        if (scene::Group* group = owner->editor->group(id))
            return *group;
        throw nb::value_error("the group was removed from its scene");
    }
    int index() const { return int(&get() - owner->scene.groups.data()); }
};

// A node of a scene, or a shader of it by its slot and handles.
struct Node {
    std::shared_ptr<Scene> owner;
    scene::NodeId id;
    std::vector<std::string> shader = {};
};
// ValueError with the refusal, where there is one.
scene::NodeId applied(Scene& scene, scene::Edit edit);

// A picture with how it came to be.
struct Picture {
    film::Picture picture;
    std::shared_ptr<Stats> stats; // null where it was read from a file
    std::shared_ptr<Journal> journal;
    bool cancelled = false;
    float exposure_gain = 1;
    film::PngEncoding encoding; // of the scene
};

void bind_journal(nb::module_& m);
void bind_material(nb::module_& m);
void bind_spectrum(nb::module_& m);
void bind_camera(nb::module_& m);
void bind_scene(nb::module_& m);
// Before bind_scene(), which makes nodes; the second adds Scene.node() and Scene.remove().
void bind_node(nb::module_& m);
void bind_nodes_of(nb::class_<Scene>& scene);
void bind_archives(nb::class_<Scene>& scene);
// Of Scene and Group alike.
template <class Owner>
void bind_meshes(nb::class_<Owner>& c);
template <class Owner>
void bind_shapes(nb::class_<Owner>& c);
template <class Owner>
void bind_patches(nb::class_<Owner>& c);
template <class Owner>
void bind_fields(nb::class_<Owner>& c);
void bind_solids_of(nb::class_<Scene>& scene, nb::class_<Group>& group);
void bind_solids(nb::module_& m);
void bind_picture(nb::module_& m);
void bind_procedurals(nb::module_& m);
void bind_load(nb::module_& m);
void bind_session(nb::module_& m);
void bind_checkpoint(nb::module_& m);
void bind_shader(nb::module_& m);
void bind_lobe(nb::module_& m);
void bind_store(nb::module_& m);
void bind_texture(nb::module_& m);

} // namespace kanuka::python
