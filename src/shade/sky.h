// Daylight: Preetham, Shirley and Smits 1999, A Practical Analytic Model for Daylight.
#pragma once

#include <memory>

#include "scene/scene.h"

namespace kanuka::shade {

// The zenith is +z. `sun`: towards the sun. Turbidity: 2 a clear day, 10 haze; the model was fitted to 2 to
// 10 and to a sun above the horizon, and both are clamped there. Values are linear Rec.709; luminance in
// units of 1000 cd/m^2, and illuminance in 1000 lux accordingly.
//
// Limits of the model: it is known to give too little light near the sun at high turbidity, and too much, and
// too red, about the horizon opposite to it. The ground is dark. Colours are the model's chromaticities,
// uplifted like any RGB: their spectra are smooth, without the lines of the air.
std::shared_ptr<const scene::LightTable> preetham_sky(const Vec3f& sun, float turbidity);
// Irradiance of a surface that faces the sun. A black body of 5778 K behind the air: molecules, aerosol,
// ozone.
Rgb preetham_sun(const Vec3f& sun, float turbidity);

} // namespace kanuka::shade
