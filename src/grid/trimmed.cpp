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

static bool same_everywhere(std::span<const TrimmedPart> parts, size_t slot) {
    const SlotValues& first = parts[0].inputs->slots[slot];
    return std::ranges::all_of(parts, [&](const TrimmedPart& p) {
        const SlotValues& s = p.inputs->slots[slot];
        const Vec3f &a = s.value, &b = first.value;
        return s.uniform && a.x == b.x && a.y == b.y && a.z == b.z;
    });
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
    mesh.vertices_per_face = 3;
    g.allocate(int(vertices) - 1, 0);
    g.flips = parts[0].grid->flips;
    g.later.resize(parts[0].grid->later.size());
    for (Grid::Step& step : g.later) {
        step.P.resize(g.P.size());
        step.N.resize(g.N.size());
    }
    inputs.stride = g.stride;
    inputs.slots.resize(parts[0].inputs->slots.size());
    for (size_t k = 0; k < inputs.slots.size(); k++) {
        inputs.slots[k] = parts[0].inputs->slots[k];
        if ((inputs.slots[k].uniform = same_everywhere(parts, k)))
            continue;
        size_t components = 1;
        for (const TrimmedPart& p : parts)
            if (const SlotValues& s = p.inputs->slots[k]; s.uniform) // as many as there may be
                components = std::max<size_t>(components, 3);
            else
                components =
                    std::max(components, s.data.size() / std::max<size_t>(1, size_t(p.inputs->stride)));
        inputs.slots[k].data.assign(components * size_t(g.stride), 0.0f);
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
        for (size_t k = 0; k < inputs.slots.size(); k++) {
            SlotValues& to = inputs.slots[k];
            if (to.uniform)
                continue;
            const SlotValues& s = parts[i].inputs->slots[k];
            const int components = int(to.data.size() / size_t(g.stride));
            if (!s.uniform) {
                blend(m, s.data, parts[i].inputs->stride,
                      std::min(components, int(s.data.size() / size_t(parts[i].inputs->stride))), to.data,
                      g.stride, first[i], k < slots.size() ? slots[k].between : Between::Linear);
                continue;
            }
            for (int c = 0; c < components; c++)
                std::fill_n(to.data.begin() + ptrdiff_t(size_t(c) * size_t(g.stride) + first[i]),
                            m.vertices.size(), s.value[c]);
        }
    }
}

} // namespace kanuka::grid
