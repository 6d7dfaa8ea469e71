#include "grid/trimmed.h"

#include <algorithm>
#include <cmath>

namespace kanuka::grid {

// Of `components` arrays; `from` is laid out with the grid's stride.
static void blend(const TrimmedMesh& mesh, const std::vector<float>& from, int from_stride, int components,
                  std::vector<float>& to, int to_stride, size_t first, Between between = Between::Linear) {
    if (from.empty())
        return;
    for (int c = 0; c < components; c++) {
        const float* x = from.data() + size_t(c) * size_t(from_stride);
        float* out = to.data() + size_t(c) * size_t(to_stride) + first;
        for (const TrimmedMesh::Vertex& v : mesh.vertices) {
            if (between == Between::Nearest) {
                const float wa = 1 - v.wb - v.wc;
                *out++ = wa >= v.wb && wa >= v.wc ? x[v.a] : v.wb >= v.wc ? x[v.b] : x[v.c];
                continue;
            }
            const auto way = [&](int to_vertex) {
                const float d = x[to_vertex] - x[v.a];
                return between == Between::Turns ? d - 0.5f * std::floor(2 * d + 0.5f) : d;
            };
            float y = x[v.a];
            if (v.wb != 0)
                y += v.wb * way(int(v.b));
            if (v.wc != 0)
                y += v.wc * way(int(v.c));
            *out++ = between == Between::Turns ? y - std::floor(y) : y;
        }
    }
}

// The slots of all parts, of which `of(part)` has one set, behind each other.
template <class Of>
static void merge_slots(std::span<const TrimmedPart> parts, const std::vector<size_t>& first,
                        std::span<const Slot> slots, const Of& of, int stride, std::vector<SlotValues>& out) {
    const auto same_everywhere = [&](size_t k) {
        const Vec3f& a = of(parts[0])[k].value;
        return std::ranges::all_of(parts, [&](const TrimmedPart& p) {
            const Vec3f& b = of(p)[k].value;
            return of(p)[k].uniform && a.x == b.x && a.y == b.y && a.z == b.z;
        });
    };
    out.resize(of(parts[0]).size());
    for (size_t k = 0; k < out.size(); k++) {
        out[k] = of(parts[0])[k];
        if ((out[k].uniform = same_everywhere(k)))
            continue;
        size_t components = 1;
        for (const TrimmedPart& p : parts)
            if (const SlotValues& s = of(p)[k]; s.uniform) // as many as there may be
                components = std::max<size_t>(components, 3);
            else
                components =
                    std::max(components, s.data.size() / std::max<size_t>(1, size_t(p.inputs->stride)));
        out[k].data.assign(components * size_t(stride), 0.0f);
        for (size_t i = 0; i < parts.size(); i++) {
            const TrimmedMesh& m = *parts[i].mesh;
            const SlotValues& s = of(parts[i])[k];
            const int from_stride = parts[i].inputs->stride;
            if (!s.uniform) {
                blend(m, s.data, from_stride, int(std::min(components, s.data.size() / size_t(from_stride))),
                      out[k].data, stride, first[i], k < slots.size() ? slots[k].between : Between::Linear);
                continue;
            }
            for (size_t c = 0; c < components; c++)
                std::fill_n(out[k].data.begin() + ptrdiff_t(c * size_t(stride) + first[i]), m.vertices.size(),
                            s.value[int(c)]);
        }
    }
}

void merge_trimmed(std::span<const TrimmedPart> parts, std::span<const Slot> slots, Grid& g,
                   VertexInputs& inputs, TracedMesh& mesh) {
    size_t vertices = 0;
    std::vector<size_t> first;
    for (const TrimmedPart& p : parts) {
        first.push_back(vertices);
        for (const uint32_t i : p.mesh->indices)
            mesh.indices.push_back(uint32_t(vertices) + i);
        vertices += p.mesh->vertices.size();
    }
    mesh.vertices_per_face = 3, mesh.of_grids = true;
    g.allocate(int(vertices) - 1, 0);
    g.flips = parts[0].grid->flips;
    g.later.resize(parts[0].grid->later.size());
    for (Grid::Step& step : g.later) {
        step.P.resize(g.P.size());
        step.N.resize(g.N.size());
    }
    inputs.stride = g.stride;
    const auto own = [](const TrimmedPart& p) -> const auto& { return p.inputs->slots; };
    merge_slots(parts, first, slots, own, g.stride, inputs.slots);
    inputs.variants.resize(parts[0].inputs->variants.size());
    for (size_t v = 0; v < inputs.variants.size(); v++) {
        const auto variant = [v](const TrimmedPart& p) -> const auto& { return p.inputs->variants[v]; };
        merge_slots(parts, first, slots, variant, g.stride, inputs.variants[v]);
    }
    for (size_t i = 0; i < parts.size(); i++) {
        const Grid& from = *parts[i].grid;
        const TrimmedMesh& m = *parts[i].mesh;
        const auto take = [&](const std::vector<float>& x, std::vector<float>& to) {
            blend(m, x, from.stride, 3, to, g.stride, first[i]);
        };
        take(from.P, g.P), take(from.N, g.N), take(from.Ng, g.Ng);
        take(from.dPdu, g.dPdu), take(from.dPdv, g.dPdv);
        for (size_t k = 0; k < g.later.size(); k++) {
            take(from.later[k].P, g.later[k].P);
            take(from.later[k].N, g.later[k].N);
        }
    }
}

} // namespace kanuka::grid
