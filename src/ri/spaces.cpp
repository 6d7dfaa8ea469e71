// RiTransformPoints: between the spaces of RISpec's table 4.1 and those that CoordinateSystem names.

#include <optional>

#include "ri/contexts.h"
#include "shade/spaces.h"

namespace kanuka::ri {

namespace {

// Both ways: a picture's space has depths near and far on one plane, which an inverse would lose.
struct Place {
    Transform root_from, from_root;
};

// Names are places in "root": the world, or before WorldBegin the camera.
class Places {
  public:
    explicit Places(const ingest::Context& context)
        : m_context(context), m_spaces(scene_of(context), {}), m_root_from_camera(camera(context)) {}

    // None: nothing is called so. Throws Error where it was squashed flat.
    std::optional<Place> find(const std::string& name) const {
        // "world" before WorldBegin: the one that would begin here.
        if (name == "object" || name == "shader" || name == "current" ||
            (name == "world" && !m_context.in_world()))
            return by_root_from(m_context.ctm);
        if (name == "world")
            return Place{};
        if (name == "camera" || name == "eye")
            return by_root_from(m_root_from_camera);
        if (name == "screen")
            return by_camera(m_spaces.screen_from_camera);
        if (name == "NDC")
            return by_camera(m_spaces.ndc_from_camera);
        if (name == "raster")
            return by_camera(m_spaces.raster_from_camera);
        const auto known = m_context.coordinate_systems.find(name);
        if (known == m_context.coordinate_systems.end())
            return std::nullopt;
        return by_root_from(known->second);
    }

  private:
    static Transform camera(const ingest::Context& context) {
        const auto known = context.coordinate_systems.find("camera"); // WorldBegin puts it there
        return context.in_world() && known != context.coordinate_systems.end() ? known->second : Transform{};
    }
    static scene::Scene scene_of(const ingest::Context& context) {
        scene::Scene scene;
        scene.options = context.options.options;
        scene.camera = context.options.camera;
        if (context.options.frame_aspect_ratio && !scene.camera.screen_window) {
            const float f = *context.options.frame_aspect_ratio;
            scene.camera.screen_window =
                f >= 1 ? std::array<float, 4>{-f, f, -1, 1} : std::array<float, 4>{-1, 1, -1 / f, 1 / f};
        }
        return scene;
    }
    static Place by_root_from(const Transform& root_from) { return {root_from, root_from.inverse()}; }
    Place by_camera(const Transform& from_camera) const {
        return {m_root_from_camera * from_camera.inverse(), from_camera * m_root_from_camera.inverse()};
    }

    const ingest::Context& m_context;
    const shade::WorldSpaces m_spaces;
    const Transform m_root_from_camera;
};

} // namespace

} // namespace kanuka::ri

using namespace kanuka;
using namespace kanuka::ri;

// Null, and the points as they were, where a space is not known.
extern "C" RtPoint* RiTransformPoints(RtToken from, RtToken to, RtInt n, RtPoint points[]) {
    const std::shared_ptr<Session> session = current();
    if (!session) {
        report_outside(RIE_NOTSTARTED, RIE_ERROR,
                       "RiTransformPoints was left out: it stands before RiBegin or after RiEnd");
        return nullptr;
    }
    try {
        const Places places(session->context());
        const auto find = [&](RtToken name) {
            const auto place = places.find(name ? name : "");
            if (!place)
                session->report(RIE_RANGE, RIE_ERROR,
                                "RiTransformPoints: there is no space \"" + std::string(name ? name : "") +
                                    "\" here; there are object, current, world, camera, screen, NDC, raster, "
                                    "and what RiCoordinateSystem named");
            return place;
        };
        const auto a = find(from), b = find(to);
        if (!a || !b)
            return nullptr;
        const Transform to_from = b->from_root * a->root_from;
        for (RtInt i = 0; i < n && points; i++) {
            const Vec3f p = to_from.point({points[i][0], points[i][1], points[i][2]});
            points[i][0] = p.x, points[i][1] = p.y, points[i][2] = p.z;
        }
    } catch (const Error& e) {
        session->report(RIE_MATH, RIE_ERROR, e.what());
        return nullptr;
    }
    return points;
}
