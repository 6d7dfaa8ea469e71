// Lights that shine from many places, asked at one of them at a time by volume shaders: analytic lights with
// an extent, what shines, skies. In RGB; each Cl is an estimate whose mean is RISpec's.
#pragma once

#include <vector>

#include "scene/scene.h"
#include "transport/scene_view.h"

namespace kanuka::render {

class WideLights {
  public:
    // The view and the lights that it was made from must outlive it.
    WideLights(const transport::SceneView& view, const std::vector<scene::Light>& lights);
    int count() const { return int(m_kinds.size()); }

    struct Sample {
        Vec3f L{0, 0, 0}; // to the place
        Rgb Cl{0, 0, 0};
        bool far = false; // L has no length
        int32_t passes = 0;
        bool shadows = true;
    };
    Sample sample(int light, const Vec3f& P, float u0, float u1) const;

  private:
    struct Kind {
        enum { Analytic, Surfaces, Constant, Picture } what;
        int index = 0; // in LightsView::analytic
        Rgb rgb{0, 0, 0};
    };
    Rgb rgb_of(const float c[4]) const; // of scale * S(lambda; c) * white
    void find_surfaces();
    Sample of_analytic(const Kind& kind, const Vec3f& P, float u0, float u1) const;
    Sample of_surfaces(const Vec3f& P, float u0, float u1) const;
    Sample of_picture(float u0, float u1) const;

    const transport::SceneView& m_view;
    std::vector<Kind> m_kinds;
    struct Triangle {
        int emitter, placement;
        Rgb rgb;
        double chance; // of all up to it
    };
    std::vector<Triangle> m_triangles;
    float m_wavelengths[4] = {0.2f, 0.4f, 0.5f, 0.7f};
};

} // namespace kanuka::render
