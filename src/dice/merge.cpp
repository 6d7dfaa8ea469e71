#include "dice/merge.h"

#include <array>

#include "base/large_arrays.h"
#include "base/tasks.h"
#include "dice/merge_outline.h"
#include "dice/outline.h"

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

bool near(float a, float b) {
    return abs(a - b) <= 1e-5f * (1 + abs(a) + abs(b));
}

// Same shading data. s and t are made from u and v where none are given.
bool same_data(const grid::Grid& g, uint32_t a, const grid::Grid& h, uint32_t b, bool parameters,
               bool texture) {
    const Vec3f n = g.normal(int(a)), m = h.normal(int(b));
    if (!(dot(n, m) > SameNormal * sqrt(length_squared(n) * length_squared(m))))
        return false;
    if (parameters && (!near(g.u[a], h.u[b]) || !near(g.v[a], h.v[b])))
        return false;
    if (texture && (!near(g.s[a], h.s[b]) || !near(g.t[a], h.t[b])))
        return false;
    for (size_t i = 0; i < g.primvars.size(); i++)
        for (int k = 0; k < g.primvars[i].components; k++)
            if (!near(g.primvars[i].component(k)[a], h.primvars[i].component(k)[b]))
                return false;
    return true;
}

constexpr uint32_t None = ~0u, Guest = 1u << 31;

// Component after component of all arrays.
std::vector<float*> components_of(grid::Grid& g) {
    std::vector<float*> out;
    each_array(g, [&](float* a, int n) {
        for (int c = 0; c < n; c++)
            out.push_back(a + size_t(c) * g.stride);
    });
    return out;
}

// Grids to evaluate pieces in, used again and again: one for every number of vertices up to five each way.
class Scratch {
  public:
    Scratch(const Splitter& splitter, const geom::Surface& surface)
        : m_splitter(splitter), m_surface(surface) {}

    // Component after component of all of the piece's lattice, or at least of `part`, which then says what
    // there is.
    const std::vector<float*>& fill(const Piece& piece, LatticePart& part) {
        bool plain = piece.nu <= MostFew && piece.nv <= MostFew;
        for (int side = 0; side < 4; side++) {
            const bool along_u = side == grid::VMin || side == grid::VMax;
            plain &= piece.sides[side].cells == (along_u ? piece.nu : piece.nv);
        }
        if (!plain)
            part = {0, 0, piece.nu, piece.nv};
        const int columns = part.columns(), rows = part.rows();
        Place& place = m_places[columns <= Few && rows <= Few ? 1 + Few * (columns - 1) + rows - 1 : 0];
        if (place.components.empty() || place.grid.nu != columns - 1 || place.grid.nv != rows - 1) {
            place.grid = {};
            place.grid.allocate(columns - 1, rows - 1);
            m_surface.allocate_channels(place.grid);
            place.components = components_of(place.grid);
        }
        if (plain)
            fill_part(m_surface, piece, part, place.grid);
        else
            fill_grid(m_splitter, m_surface, piece, place.grid);
        return place.components;
    }

  private:
    static constexpr int Few = 5;
    struct Place {
        grid::Grid grid;
        std::vector<float*> components;
    };
    const Splitter& m_splitter;
    const geom::Surface& m_surface;
    std::array<Place, 1 + Few * Few> m_places;
};

// Every piece's vertices have a slot each, and every slot ends up with a vertex. The first slot of a point
// owns its vertex. The others are its guests: they share it if their data are the same, and have one of their
// own, after all owners', if not. Where the surface is smooth nobody asks.
class Merger {
  public:
    Merger(const Splitter& splitter, bool parameters)
        : m_splitter(splitter), m_pieces(splitter.pieces),
          m_parameters(parameters || !splitter.surface().own_parameters()) {}

    geom::MeshParts merge() {
        number();
        geom::MeshParts out;
        geom::allocate_mesh(out, m_owners, m_splitter.surface());
        evaluate(m_splitter.surface(), out.vertices, !m_guests.empty());
        take_guests(out);
        out.vertices.flips = m_splitter.surface().flips();
        list_quads(out.mesh);
        return out;
    }

    geom::MeshParts later(const geom::Surface& surface) const {
        geom::MeshParts out;
        geom::allocate_mesh(out, m_owners + m_more.size(), surface);
        out.vertices.flips = surface.flips();
        const_cast<Merger*>(this)->evaluate(surface, out.vertices, false);
        move_to_owners(out.vertices);
        return out;
    }

    // Of a vertex, the one that its point has.
    std::vector<uint32_t> points() const {
        std::vector<uint32_t> out(m_owners + m_more.size());
        for (size_t v = 0; v < out.size(); v++)
            out[v] = v < m_owners ? uint32_t(v) : m_more[v - m_owners].owner;
        return out;
    }

    // Which of those lie on edges that faces have on one side alone.
    std::vector<char> borders() const {
        const std::vector<char> open = open_edges(m_splitter.surface().topology());
        std::vector<char> out(m_owners + m_more.size(), 0);
        for (size_t i = 0; i < m_pieces.size(); i++)
            for (int side = 0; side < 4; side++) {
                const int t = m_splitter.edges[size_t(m_pieces[i].sides[side].edge)].topology;
                if (t < 0 || !open[size_t(t)])
                    continue;
                const bool along_u = side == grid::VMin || side == grid::VMax;
                const int nu = m_pieces[i].nu, nv = m_pieces[i].nv, step = along_u ? 1 : nu + 1;
                const int first = side == grid::VMax ? nv * (nu + 1) : side == grid::UMax ? nu : 0;
                for (int k = 0; k <= (along_u ? nu : nv); k++) {
                    const uint32_t v = m_vertex[m_first_slot[i] + size_t(first + k * step)];
                    out[v < m_owners ? v : m_more[v - m_owners].owner] = 1;
                }
            }
        return out;
    }

  private:
    void number() {
        m_first_slot.assign(m_pieces.size() + 1, 0);
        m_first_quad.assign(m_pieces.size() + 1, 0);
        for (size_t i = 0; i < m_pieces.size(); i++) {
            m_first_slot[i + 1] = m_first_slot[i] + size_t(m_pieces[i].nu + 1) * (m_pieces[i].nv + 1);
            m_first_quad[i + 1] = m_first_quad[i] + size_t(m_pieces[i].nu) * m_pieces[i].nv;
        }
        // Points of slots first, which become vertices in the same place.
        const size_t slots = m_first_slot.back();
        m_vertex.assign(slots, None);
        tasks::parallel_chunks(m_pieces.size(), Grain, [&](size_t begin, size_t end) {
            std::vector<BoundaryVertex> boundary;
            for (size_t i = begin; i < end; i++) {
                list_boundary(m_splitter, m_pieces[i], boundary);
                for (const BoundaryVertex& b : boundary)
                    m_vertex[m_first_slot[i] + b.index] = uint32_t(b.point);
            }
        });
        std::vector<uint32_t> owner(size_t(m_splitter.points()), None); // vertex of a point
        std::vector<char> smooth;                                       // by vertex
        smooth.reserve(slots / 2);
        m_first_vertex.reserve(m_pieces.size());
        for (size_t i = 0; i < m_pieces.size(); i++) {
            const bool joins = !m_parameters && m_splitter.surface().joins_smoothly(m_pieces[i].face);
            m_first_vertex.push_back(uint32_t(smooth.size()));
            for (size_t s = m_first_slot[i]; s < m_first_slot[i + 1]; s++) {
                const uint32_t point = m_vertex[s];
                if (point == None || owner[point] == None) {
                    m_vertex[s] = uint32_t(smooth.size());
                    if (point != None)
                        owner[point] = m_vertex[s];
                    smooth.push_back(joins);
                } else if (joins || smooth[owner[point]]) {
                    m_vertex[s] = owner[point];
                } else {
                    m_vertex[s] = Guest | uint32_t(m_guests.size());
                    m_guests.push_back({uint32_t(s), owner[point]});
                }
            }
        }
        m_owners = smooth.size();
        if (!m_guests.empty()) {
            m_guest_data.allocate(int(m_guests.size()) - 1, 0);
            m_splitter.surface().allocate_channels(m_guest_data);
        }
    }

    // All pieces, each into the vertices that it is the source of, and its guests into their own place.
    void evaluate(const geom::Surface& surface, grid::Grid& to, bool guests) {
        const std::vector<float*> out = components_of(to), guest_out = components_of(m_guest_data);
        tasks::parallel_chunks(m_pieces.size(), Grain, [&](size_t begin, size_t end) {
            Scratch scratch(m_splitter, surface);
            std::vector<uint32_t> from, other_from, other_at; // its own vertices, which are in a row; others
            for (size_t i = begin; i < end; i++) {
                from.clear(), other_from.clear(), other_at.clear();
                const uint32_t first = m_first_vertex[i], row = uint32_t(m_pieces[i].nu + 1);
                for (size_t s = m_first_slot[i]; s < m_first_slot[i + 1]; s++) {
                    const uint32_t v = m_vertex[s], k = uint32_t(s - m_first_slot[i]);
                    if (v == first + from.size())
                        from.push_back(k);
                    else if (guests && (v & Guest))
                        other_from.push_back(k), other_at.push_back(v & ~Guest);
                    else if (v >= m_owners && m_more[v - m_owners].slot == s)
                        other_from.push_back(k), other_at.push_back(v);
                }
                if (from.empty() && other_from.empty())
                    continue;
                // What other pieces own is not evaluated again.
                LatticePart part{int(row), m_pieces[i].nv + 1, 0, 0};
                for (const auto* list : {&from, &other_from})
                    for (const uint32_t k : *list) {
                        const int u = int(k % row), v = int(k / row);
                        part = {std::min(part.i0, u), std::min(part.j0, v), std::max(part.i1, u),
                                std::max(part.j1, v)};
                    }
                const std::vector<float*>& in = scratch.fill(m_pieces[i], part);
                for (auto* list : {&from, &other_from})
                    for (uint32_t& k : *list)
                        k = (k / row - uint32_t(part.j0)) * uint32_t(part.columns()) + k % row -
                            uint32_t(part.i0);
                for (size_t c = 0; c < out.size(); c++) {
                    const float* const data = in[c];
                    float* const own = out[c] + first;
                    for (size_t k = 0; k < from.size(); k++)
                        own[k] = data[from[k]];
                    float* const other = guests ? guest_out[c] : out[c];
                    for (size_t k = 0; k < other_from.size(); k++)
                        other[other_at[k]] = data[other_from[k]];
                }
            }
        });
    }

    // Guests share a vertex of their point or get one.
    void take_guests(geom::MeshParts& out) {
        if (m_guests.empty())
            return;
        const bool texture = m_splitter.surface().has_texture();
        std::vector<uint32_t> next(m_owners, None); // of a vertex: the next one of its point
        std::vector<uint32_t> data;                 // of vertices beyond the owners': which guest's
        for (uint32_t g = 0; g < m_guests.size(); g++) {
            uint32_t v = m_guests[g].owner, last = None;
            for (; v != None; last = v, v = next[v])
                if (v < m_owners
                        ? same_data(out.vertices, v, m_guest_data, g, m_parameters, texture)
                        : same_data(m_guest_data, data[v - m_owners], m_guest_data, g, m_parameters, texture))
                    break;
            if (v == None) {
                v = uint32_t(m_owners + m_more.size());
                next[last] = v;
                next.push_back(None);
                data.push_back(g);
                m_more.push_back(m_guests[g]);
            }
            m_vertex[m_guests[g].slot] = v;
        }
        if (!data.empty()) {
            geom::MeshParts all;
            geom::allocate_mesh(all, m_owners + m_more.size(), m_splitter.surface());
            const std::vector<float*> from = components_of(out.vertices), more = components_of(m_guest_data),
                                      to = components_of(all.vertices);
            tasks::parallel_for(to.size(), [&](size_t c) {
                std::copy_n(from[c], m_owners, to[c]);
                for (size_t k = 0; k < data.size(); k++)
                    to[c][m_owners + k] = more[c][data[k]];
            });
            out = std::move(all);
            move_to_owners(out.vertices);
        }
        m_guest_data = {};
    }

    // One position for all vertices of a point, bit for bit.
    void move_to_owners(grid::Grid& g) const {
        for (size_t k = 0; k < m_more.size(); k++)
            for (int c = 0; c < 3; c++)
                g.P[m_owners + k + size_t(c) * g.stride] = g.P[m_more[k].owner + size_t(c) * g.stride];
    }

    void list_quads(grid::TracedMesh& mesh) const {
        mesh.vertices_per_face = 4;
        reserve_large(mesh.indices, 4 * m_first_quad.back());
        mesh.indices.resize(4 * m_first_quad.back());
        tasks::parallel_chunks(m_pieces.size(), Grain, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) {
                uint32_t* to = &mesh.indices[4 * m_first_quad[i]];
                const int row = m_pieces[i].nu + 1;
                for (int v = 0; v < m_pieces[i].nv; v++)
                    for (int u = 0; u < m_pieces[i].nu; u++) {
                        const size_t s = m_first_slot[i] + size_t(v) * row + u;
                        for (const size_t k : {s, s + 1, s + row + 1, s + row})
                            *to++ = m_vertex[k];
                    }
            }
        });
    }

    struct GuestSlot {
        uint32_t slot, owner; // the vertex that its point has
    };
    const Splitter& m_splitter;
    const std::vector<Piece>& m_pieces;
    const bool m_parameters; // u and v count
    std::vector<size_t> m_first_slot, m_first_quad;
    std::vector<uint32_t> m_vertex;          // of a slot
    std::vector<uint32_t> m_first_vertex;    // of those that a piece owns, which are in a row
    std::vector<GuestSlot> m_guests, m_more; // all; those that got a vertex, in order
    grid::Grid m_guest_data;
    size_t m_owners = 0;
};

} // namespace

std::vector<geom::MeshParts> merge_pieces(const Splitter& splitter,
                                          std::span<const std::unique_ptr<geom::Surface>> later,
                                          bool parameters, bool outlines) {
    Merger merger(splitter, parameters);
    std::vector<geom::MeshParts> parts;
    parts.push_back(merger.merge());
    for (const auto& surface : later)
        parts.push_back(merger.later(*surface));
    if (outlines) {
        const std::vector<uint32_t> points = merger.points();
        const std::vector<char> borders = merger.borders();
        for (geom::MeshParts& p : parts)
            (&p == &parts[0] ? p.mesh.P : p.vertices.P) =
                standing_off(p.vertices, parts[0].mesh, points, borders);
    }
    return parts;
}

} // namespace kanuka::dice
