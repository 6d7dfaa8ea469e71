// Emitters of a page that has been shaded: how much they shine, and which of them are asked for light.
#pragma once

#include <span>

#include "bvh/bvh.h"
#include "scene/scene.h"
#include "store/store.h"

namespace kanuka::render {

// An area light whose amount is of the whole of it (lumen, watt, candela) spreads it over its area.
void spread_flux(const scene::ShaderRef& light, store::Page& page);
// Those that are not asked are found by rays alone.
void ask_no_emitters(store::Page& page);
// Nobody asks for light that may be cut away: by a solid's other parts, by planes.
void ask_uncut_emitters(store::Page& page, std::span<const bvh::Scene::Plane> clips, bool of_solid,
                        bool at_rest);
// All that shines are points and lines.
bool shines_without_area(const store::Page& page);

} // namespace kanuka::render
