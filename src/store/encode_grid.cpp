#include "store/encode_grid.h"

#include "store/encode_parts.h"

namespace kanuka::store {

namespace {

float log2_step(int step) {
    return float(__builtin_ctz(unsigned(step)));
}

// With the radius behind each, if there are any.
std::vector<float> interleaved(const grid::Grid& grid, const std::vector<float>& p,
                               const std::vector<float>& radius) {
    const size_t each = radius.empty() ? 3 : 4;
    std::vector<float> out(size_t(grid.vertices()) * each);
    for (int i = 0; i < grid.vertices(); i++) {
        for (int c = 0; c < 3; c++)
            out[size_t(i) * each + size_t(c)] = p[size_t(c) * size_t(grid.stride) + size_t(i)];
        if (each == 4)
            out[size_t(i) * each + 3] = radius[size_t(i)];
    }
    return out;
}

// What the ray tracer reads, and the record that names it.
void encode_geometry(const ShadedGrid& shaded, const grid::LayeringProgram& program, Encoded& out) {
    const grid::Grid& grid = *shaded.grid;
    ShapeRecord& s = out.shape;
    s.links = 0;
    s.interior = -1;
    if (program.shines_both)
        s.flags |= ShapeRecord::ShinesBoth;
    s.motion_segments = int(grid.later.size());
    s.nu = grid.nu;
    s.nv = grid.nv;
    s.flags |= grid.flips ? ShapeRecord::Flips : 0;
    if (shaded.mesh) {
        const grid::TracedMesh& mesh = *shaded.mesh;
        const bool fibre = !mesh.radius.empty();
        s.flags |= ShapeRecord::Mesh | (mesh.vertices_per_face == 4 ? ShapeRecord::Quads : 0) |
                   (fibre ? ShapeRecord::Fibre : 0) | (mesh.balls ? ShapeRecord::Balls : 0) |
                   (mesh.of_grids ? ShapeRecord::OfGrids : 0) |
                   (mesh.around && program.is_layer() ? ShapeRecord::Layer : 0);
        s.mu = grid.vertices();
        s.mv = int(mesh.indices.size() / mesh.vertices_per_face);
        out.positions = interleaved(grid, mesh.P.empty() ? grid.P : mesh.P, mesh.radius);
        for (size_t k = 0; k < grid.later.size(); k++)
            out.later.push_back(interleaved(
                grid, grid.later[k].P, k < mesh.later_radius.size() ? mesh.later_radius[k] : mesh.radius));
        out.indices = mesh.indices;
        return;
    }
    const grid::TracedGrid& t = *shaded.traced;
    s.mu = t.mu;
    s.mv = t.mv;
    s.steps = int(log2_step(t.step_u)) | int(log2_step(t.step_v)) << 4;
    for (int e = 0; e < 4; e++) {
        s.steps |= int(log2_step(t.edge_step[e])) << (8 + 4 * e);
        if (t.edge_step[e] > (e % 2 == 0 ? t.step_u : t.step_v))
            s.flags |= ShapeRecord::Collapsed;
    }
    out.positions.assign(t.P.begin(), t.P.begin() + size_t(t.mu + 1) * (t.mv + 1) * 3);
    out.later = t.later;
}

} // namespace

void encode_grid(const ShadedGrid& shaded, const grid::LayeringProgram& program,
                 const grid::WordLayout& layout, const color::Palette& palette, Encoded& out) {
    GridInputs inputs(shaded, program, out);
    encode_geometry(shaded, program, out);
    encode_words(inputs, layout, palette, out);
    const UnitNormals normals = encode_normals(*shaded.grid, out);
    if (shaded.smooth && is_coarse(shaded, normals, out))
        out.shape.flags |= ShapeRecord::Rounded;
    if (program.opacity[0] >= 0 && inputs.is_tinted())
        out.shape.flags |= ShapeRecord::Tinted;
    if (program.needs_tangent())
        encode_tangents(*shaded.grid, normals, out);
    for (const std::vector<grid::SlotValues>& slots : shaded.inputs->variants) {
        GridInputs variant(shaded, slots, program, out);
        encode_words(variant, layout, palette, out);
    }
    if (program.emits())
        encode_emitters(shaded, inputs, palette, normals, out);
    else
        out.shape.emitter = -1;
}

} // namespace kanuka::store
