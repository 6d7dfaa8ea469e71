// What render() and sessions take: the one declaration of their arguments.
#pragma once

#include "python/keywords.h"
#include "render/session.h"

namespace kanuka::python {

struct RenderRequest {
    render::Overrides overrides;
    std::optional<std::filesystem::path> store; // none = the environment's
    std::string store_mode, store_size, memory, oracle;
    nb::object progress = nb::none();
    std::shared_ptr<Journal> journal;
    std::vector<Camera> shot;

    // What arguments say of the store goes over what the environment says.
    store::DiskStore::Settings store_settings() const;
    std::optional<MemoryBudget> memory_budget() const; // none = the environment's
    // What the scene says besides, and where shaders and the store are. Python may write options of its own
    // while the picture is made: the scene gets those of now.
    void complete(Scene& scene);
};

// While it lives, nothing may change the scene.
class Reading {
  public:
    explicit Reading(Scene& scene) : m_now(scene.is_rendered) {
        check_idle(scene);
        m_now = true;
    }
    ~Reading() { m_now = false; }
    Reading(const Reading&) = delete;

  private:
    bool& m_now;
};

// The calls' own, then every option of a scene.
std::span<const Keyword<RenderRequest>> render_keywords();

// Throws nb::value_error, with the argument's name, where a layer's name is no light path expression.
void check_layer(const std::string& text, const std::string& name);

} // namespace kanuka::python
