// Coordinate systems that a shader may name.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "base/digest.h"
#include "base/vec.h"
#include "scene/scene.h"

namespace kanuka::shade {

// What all primitives of a scene share. "screen", "NDC" and "raster" are RISpec's: projective, z kept as
// screen depth.
struct WorldSpaces {
    Transform camera_from_world;
    Transform screen_from_camera, ndc_from_camera, raster_from_camera;
    std::map<std::string, Transform> world_from_named;

    WorldSpaces(const scene::Scene& scene, const Transform& camera_from_world)
        : WorldSpaces(scene, scene.options, scene.camera, camera_from_world) {}
    // With the picture and the camera that a render has, which may differ from the scene's.
    WorldSpaces(const scene::Scene& scene, const scene::Options& options, const scene::Camera& camera,
                const Transform& camera_from_world);
};

// What shaders have read of what is around a primitive, where it stands and textures: what they made is good
// wherever this has the same values.
struct SpacesRead {
    std::set<std::pair<std::string, std::string>> transforms; // to, from
    bool eye = false;
    bool world = false; // current_from_world, by which lights are placed
    std::set<std::string>
        files; // textures, by the names that shaders have for them; not of Spaces::digest_of()

    void add(const SpacesRead& other);
    bool operator==(const SpacesRead&) const = default;
};

// Gathers that while shaders run, on any number of threads.
class SpacesLog {
  public:
    void add(const SpacesRead& read) {
        const std::lock_guard lock(m_mutex);
        m_read.add(read);
    }
    SpacesRead read() const {
        const std::lock_guard lock(m_mutex);
        return m_read;
    }

  private:
    mutable std::mutex m_mutex;
    SpacesRead m_read;
};

// One primitive's: "current" is the space of Grid::P. It has the axes and units of the world, or of the group
// that the primitive is in, and mostly the origin of object space.
struct Spaces {
    const WorldSpaces* shared = nullptr;
    const scene::ValueList* scoped = nullptr; // attributes with coordinate systems of its own; null = none
    Transform current_from_object, current_from_world, current_from_shader;

    // current, object, shader, world, camera (eye), screen, NDC, raster, or a CoordinateSystem by name.
    std::optional<Transform> current_from(std::string_view name) const;
    std::optional<Transform> to_from(std::string_view to, std::string_view from) const;
    Vec3f eye() const; // the camera's position, in current space
    // The values of what was read, in single precision, as shaders see them.
    Digest digest_of(const SpacesRead& read) const;
};

// The inverse, or the identity for a singular matrix.
Transform inverse_or_identity(const Transform& transform);

} // namespace kanuka::shade
