#include "transport/light_emission.h"

#include <cmath>

namespace kanuka::transport {

namespace {

// pi times what LightBound has, by what that is: see make_light() in analytic_lights.cpp.
double power_of_light(const AnalyticLight& light, const LightBound& bound, double radius) {
    const double amount = std::max(double(bound.power), 0.0), pi = double(Pi);
    switch (light.shape) {
    case AnalyticLight::Distant:
        return pi * radius * radius * amount;
    case AnalyticLight::Quad:
    case AnalyticLight::Disk:
        return pi * amount;
    case AnalyticLight::Cylinder:
        return pi * pi * amount;
    default: // points and balls, spots too
        return 2 * pi * (1 - std::max(double(light.cos_outer), -1.0)) * amount;
    }
}

} // namespace

EmissionLights::EmissionLights(const SceneView& scene, const Bounds3f& bounds)
    : m_analytic(int(scene.lights.analytic.size())), m_center(bounds.center()),
      m_radius(std::max(0.5f * length(bounds.diagonal()), 1e-6f)) {
    const LightsView& view = scene.lights;
    const double radius = double(m_radius), sky = 4 * double(Pi) * double(Pi) * radius * radius;
    std::vector<double> powers;
    for (size_t k = 0; k < view.analytic.size(); k++)
        powers.push_back(power_of_light(view.analytic[k], view.bounds[k], radius));
    powers.push_back(view.map.width > 0 ? sky * double(view.map.mean) : 0);
    powers.push_back(view.constant.present ? sky * 0.5 * double(view.constant.c[3]) : 0); // twice its maximum
    for (const float power : view.slots.power)
        powers.push_back(double(Pi) * std::max(double(power), 0.0));
    double total = 0;
    for (double& power : powers)
        total += power = std::isfinite(power) ? power : 0;
    if (!(total > 0))
        return;
    double sum = 0;
    m_cumulative.push_back(0);
    for (const double power : powers)
        m_cumulative.push_back(float((sum += power) / total)); // 1 behind the last that shines
}

} // namespace kanuka::transport
