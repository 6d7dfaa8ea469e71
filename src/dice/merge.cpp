#include "dice/merge.h"

#include "base/tasks.h"

namespace kanuka::dice {
namespace {

constexpr size_t Grain = 256;
constexpr float SameNormal = 0.9998f; // cosine of about 1 degree, as for seams

// All arrays of a grid, channel after channel, as (pointer, components).
template <class Visit>
void each_array(grid::Grid& g, Visit visit) {
    for (std::vector<float>* a : {&g.P, &g.N, &g.Ng, &g.dPdu, &g.dPdv})
        visit(a->data(), 3);
    for (std::vector<float>* a : {&g.u, &g.v, &g.s, &g.t})
        visit(a->data(), 1);
    for (grid::Channel& c : g.primvars)
        visit(c.data.data(), c.components);
}

// copy(source array, target array) for every component of every array.
template <class Copy>
void each_component(const grid::Grid& source, grid::Grid& target, Copy copy) {
    std::vector<const float*> from;
    each_array(const_cast<grid::Grid&>(source), [&](float* a, int n) {
        for (int c = 0; c < n; c++)
            from.push_back(a + size_t(c) * source.stride);
    });
    size_t k = 0;
    each_array(target, [&](float* a, int n) {
        for (int c = 0; c < n; c++)
            copy(from[k++], a + size_t(c) * target.stride);
    });
}

bool near(float a, float b) {
    return abs(a - b) <= 1e-5f * (1 + abs(a) + abs(b));
}

// Same shading data, whatever their faces' own u and v (which make s and t where none are given).
bool same_data(const grid::Grid& g, uint32_t a, uint32_t b, bool texture) {
    const Vec3f n = g.normal(int(a)), m = g.normal(int(b));
    if (!(dot(n, m) > SameNormal * sqrt(length_squared(n) * length_squared(m))))
        return false;
    if (texture && (!near(g.s[a], g.s[b]) || !near(g.t[a], g.t[b])))
        return false;
    for (const grid::Channel& c : g.primvars)
        for (int k = 0; k < c.components; k++)
            if (!near(c.component(k)[a], c.component(k)[b]))
                return false;
    return true;
}

} // namespace

void copy_vertices(const grid::Grid& source, size_t from, grid::Grid& target, size_t to, size_t count) {
    each_component(source, target, [&](const float* a, float* b) { std::copy_n(a + from, count, b + to); });
}

std::vector<geom::MeshParts> merge_pieces(const Splitter& splitter,
                                          std::span<const std::unique_ptr<geom::Surface>> later) {
    const std::vector<Piece>& pieces = splitter.pieces;
    // Every piece's vertices, on their own: a slot each.
    std::vector<size_t> first_slot(pieces.size() + 1, 0), first_quad(pieces.size() + 1, 0);
    for (size_t i = 0; i < pieces.size(); i++) {
        first_slot[i + 1] = first_slot[i] + size_t(pieces[i].nu + 1) * (pieces[i].nv + 1);
        first_quad[i + 1] = first_quad[i] + size_t(pieces[i].nu) * pieces[i].nv;
    }
    const size_t slots = first_slot.back();
    geom::MeshParts all;
    geom::allocate_mesh(all, slots, splitter.surface());
    std::vector<uint32_t> point(slots); // shared ones first, then each inner vertex its own
    tasks::parallel_chunks(pieces.size(), Grain, [&](size_t begin, size_t end) {
        std::vector<BoundaryVertex> boundary;
        for (size_t i = begin; i < end; i++) {
            grid::Grid g = make_grid(splitter, pieces[i]);
            copy_vertices(g, 0, all.vertices, first_slot[i], size_t(g.vertices()));
            for (int v = 0; v < g.vertices(); v++)
                point[first_slot[i] + v] = uint32_t(splitter.points() + first_slot[i] + v);
            list_boundary(splitter, pieces[i], boundary);
            for (const BoundaryVertex& b : boundary)
                point[first_slot[i] + b.index] = uint32_t(b.point);
        }
    });
    // Slots by point, then one vertex for each distinct set of data.
    const size_t points = size_t(splitter.points()) + slots;
    std::vector<uint32_t> first(points + 1, 0), list(slots);
    for (const uint32_t p : point)
        first[p + 1]++;
    for (size_t p = 1; p <= points; p++)
        first[p] += first[p - 1];
    std::vector<uint32_t> at(first.begin(), first.end() - 1);
    for (size_t s = 0; s < slots; s++)
        list[at[point[s]]++] = uint32_t(s);
    std::vector<uint32_t> vertex(slots), source;
    source.reserve(slots / 2);
    grid::Grid& g = all.vertices;
    for (size_t p = 0; p < points; p++) {
        const size_t head = source.size();
        for (uint32_t k = first[p]; k < first[p + 1]; k++) {
            const uint32_t s = list[k];
            for (int c = 0; c < 3; c++) // one position, bit for bit
                g.P[s + size_t(c) * g.stride] = g.P[list[first[p]] + size_t(c) * g.stride];
            size_t v = head;
            while (v < source.size() && !same_data(g, source[v], s, splitter.surface().has_texture()))
                v++;
            if (v == source.size())
                source.push_back(s);
            vertex[s] = uint32_t(v);
        }
    }
    geom::MeshParts out;
    geom::allocate_mesh(out, source.size(), splitter.surface());
    out.vertices.flips = splitter.surface().flips();
    const auto gather = [&](grid::Grid& to) {
        tasks::parallel_chunks(source.size(), 1 << 15, [&](size_t begin, size_t end) {
            each_component(g, to, [&](const float* a, float* b) {
                for (size_t i = begin; i < end; i++)
                    b[i] = a[source[i]];
            });
        });
    };
    gather(out.vertices);
    out.mesh.vertices_per_face = 4;
    out.mesh.indices.resize(4 * first_quad.back());
    tasks::parallel_chunks(pieces.size(), Grain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            uint32_t* to = &out.mesh.indices[4 * first_quad[i]];
            const int row = pieces[i].nu + 1;
            for (int v = 0; v < pieces[i].nv; v++)
                for (int u = 0; u < pieces[i].nu; u++) {
                    const size_t s = first_slot[i] + size_t(v) * row + u;
                    for (const size_t k : {s, s + 1, s + row + 1, s + row})
                        *to++ = vertex[k];
                }
        }
    });
    std::vector<geom::MeshParts> parts;
    parts.push_back(std::move(out));
    for (const auto& surface : later) {
        tasks::parallel_chunks(pieces.size(), Grain, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                const grid::Grid piece = make_grid(splitter, *surface, pieces[i]);
                copy_vertices(piece, 0, g, first_slot[i], size_t(piece.vertices()));
            }
        });
        for (size_t s = 0; s < slots; s++)
            for (int c = 0; c < 3; c++)
                g.P[s + size_t(c) * g.stride] = g.P[list[first[point[s]]] + size_t(c) * g.stride];
        geom::MeshParts part;
        geom::allocate_mesh(part, source.size(), *surface);
        part.vertices.flips = surface->flips();
        gather(part.vertices);
        parts.push_back(std::move(part));
    }
    return parts;
}

} // namespace kanuka::dice
