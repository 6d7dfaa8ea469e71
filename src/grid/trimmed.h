// Grids of which a part is cut away: shaded as grids, so that derivatives are what they are, and traced as
// triangles whose corners are vertices of the grid or lie between some.
#pragma once

#include <span>

#include "grid/grid.h"
#include "grid/layering.h"

namespace kanuka::grid {

struct TrimmedMesh {
    // value(a) + wb * (value(b) - value(a)) + wc * (value(c) - value(a))
    struct Vertex {
        uint32_t a, b, c;
        float wb, wc;
    };
    std::vector<Vertex> vertices;
    std::vector<uint32_t> indices; // three a triangle
};

struct TrimmedPart {
    const Grid* grid;
    const VertexInputs* inputs;
    const TrimmedMesh* mesh;
};

// All parts of a primitive as one mesh with its inputs. Slots that are uniform and equal in all parts stay
// so. `slots`: of their program.
void merge_trimmed(std::span<const TrimmedPart> parts, std::span<const Slot> slots, Grid& vertices,
                   VertexInputs& inputs, TracedMesh& mesh);

} // namespace kanuka::grid
