// One maker a kind of geometry; make_surface() picks.
#pragma once

#include "geom/surface.h"

namespace kanuka::geom {

using SurfacePtr = std::unique_ptr<Surface>;

SurfacePtr make_polygons(const scene::Primitive&, const scene::PolygonMesh&, const Transform&, Journal&,
                         SurfaceHints);
SurfacePtr make_subdivision(const scene::Primitive&, const scene::SubdivisionMesh&, const Transform&,
                            Journal&, SurfaceHints);
SurfacePtr make_patch_mesh(const scene::Primitive&, const scene::PatchMesh&, const Transform&, Journal&);
SurfacePtr make_nupatch(const scene::Primitive&, const scene::NuPatch&, const Transform&, Journal&);
SurfacePtr make_quadric(const scene::Primitive&, const scene::Quadric&, const Transform&, Journal&,
                        SurfaceHints);

} // namespace kanuka::geom
