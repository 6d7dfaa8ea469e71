// Hierarchical edits of a subdivision mesh (tags "vertexedit", "edgeedit", "faceedit"). Only subdivision*.cpp
// include this.
#pragma once

#include "geom/subdivision.h"

namespace kanuka::geom {

bool has_edits(const scene::SubdivisionMesh& mesh);

// Refines the cage, its points and primvars (all in the page's space) to the deepest level that an edit
// names, level by level, and makes each level's edits on the way: what follows is refined from what was
// edited. The cage's limit surface is that of the mesh, edits aside. Edits that fit nothing are left out and
// reported.
void apply_edits(const scene::Primitive& primitive, const scene::SubdivisionMesh& mesh,
                 const Transform& page_from_object, Cage& cage, ControlPoints& points, Primvars& primvars,
                 Journal& journal);

} // namespace kanuka::geom
