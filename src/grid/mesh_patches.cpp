#include "grid/mesh_patches.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/tasks.h"

namespace kanuka::grid {

std::array<float, 2> corner_parameters(bool triangle, int k) {
    static constexpr std::array<float, 2> Quad[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static constexpr std::array<float, 2> Triangle[] = {{0, 0}, {1, 0}, {0.5f, 1}};
    return triangle ? Triangle[std::min(k, 2)] : Quad[k];
}

static int corners_of(const TracedMesh& mesh, size_t face) {
    const uint32_t* q = &mesh.indices[face * size_t(mesh.vertices_per_face)];
    return mesh.vertices_per_face == 4 && q[2] != q[3] ? 4 : 3;
}

// Do they span a plane, as far as rounding lets know?
static bool spans(const Vec3f& a, const Vec3f& b) {
    return length_squared(cross(a, b)) > 1e-12f * length_squared(a) * length_squared(b);
}

void complete_frames(Grid& g, const TracedMesh& mesh) {
    if (!mesh.radius.empty())
        return; // fibres have theirs
    const size_t n = size_t(g.stride), per = size_t(mesh.vertices_per_face);
    std::vector<char> done(size_t(g.vertices()));
    for (size_t i = 0; i < done.size(); i++) {
        bool any = false;
        for (size_t c = 0; c < 3; c++)
            any = any || g.dPdu[i + c * n] != 0 || g.dPdv[i + c * n] != 0;
        done[i] = any;
    }
    if (std::ranges::all_of(done, [](char d) { return d; }))
        return;
    for (size_t f = 0; f < mesh.indices.size() / per; f++) {
        const uint32_t* q = &mesh.indices[f * per];
        const int corners = corners_of(mesh, f);
        for (int k = 0; k < corners; k++) {
            if (done[q[k]])
                continue;
            const Vec3f a = g.position(int(q[0])), b = g.position(int(q[1])), c = g.position(int(q[2]));
            Vec3f u = b - a, v = c - (a + b) * 0.5f;
            if (corners == 4) {
                const Vec3f d = g.position(int(q[3]));
                u = k < 2 ? b - a : c - d;
                v = k == 0 || k == 3 ? d - a : c - b;
            }
            if (!spans(u, v))
                continue; // collapsed: another face may do
            done[q[k]] = true;
            for (size_t e = 0; e < 3; e++)
                g.dPdu[q[k] + e * n] = u[int(e)], g.dPdv[q[k] + e * n] = v[int(e)];
        }
    }
}

// ---- patches

MeshPatches::MeshPatches(const Grid& vertices, const TracedMesh& mesh, const std::vector<float>& rest,
                         int rings)
    : m_grid(vertices), m_mesh(mesh), m_rest(rest), m_stride(size_t(vertices.stride)), m_rings(rings) {
    if (rings > 0) {
        list_faces();
        sort_vertices();
    } else {
        m_order.resize(size_t(vertices.vertices()));
        std::iota(m_order.begin(), m_order.end(), 0u);
    }
}

int MeshPatches::corners(uint32_t face) const {
    return corners_of(m_mesh, face);
}

void MeshPatches::list_faces() {
    if (!m_mesh.radius.empty()) {
        m_goes_on.assign(size_t(m_grid.vertices()), 0);
        for (const uint32_t v : m_mesh.indices)
            m_goes_on[v] = !m_mesh.balls;
        return;
    }
    const size_t per = size_t(m_mesh.vertices_per_face), faces = m_mesh.indices.size() / per;
    m_first_face.assign(size_t(m_grid.vertices()) + 1, 0);
    for (size_t f = 0; f < faces; f++)
        for (int k = 0; k < corners(uint32_t(f)); k++)
            m_first_face[m_mesh.indices[f * per + size_t(k)] + 1]++;
    for (size_t v = 1; v < m_first_face.size(); v++)
        m_first_face[v] += m_first_face[v - 1];
    m_face.resize(m_first_face.back());
    std::vector<uint32_t> at(m_first_face.begin(), m_first_face.end() - 1);
    for (size_t f = 0; f < faces; f++)
        for (int k = 0; k < corners(uint32_t(f)); k++)
            m_face[at[m_mesh.indices[f * per + size_t(k)]]++] = uint32_t(f);
}

// Along a Z-order curve through the bounding box: 1024 cells each way are more than there are patches.
void MeshPatches::sort_vertices() {
    const size_t n = size_t(m_grid.vertices());
    Bounds3f box;
    for (uint32_t v = 0; v < n; v++)
        box.extend(rest(v));
    const auto spread = [](uint32_t x) { // ten bits to every third one
        x = (x | x << 16) & 0x030000ff;
        x = (x | x << 8) & 0x0300f00f;
        x = (x | x << 4) & 0x030c30c3;
        return (x | x << 2) & 0x09249249;
    };
    std::vector<uint64_t> keys(n), other(n);
    tasks::parallel_chunks(n, 1 << 15, [&](size_t begin, size_t end) {
        for (size_t v = begin; v < end; v++) {
            uint32_t code = 0;
            for (int c = 0; c < 3; c++) {
                const float size = box.hi[c] - box.lo[c];
                const float x = size > 0 ? (rest(uint32_t(v))[c] - box.lo[c]) / size * 1023 : 0;
                code |= spread(uint32_t(std::clamp(x, 0.0f, 1023.0f))) << c;
            }
            keys[v] = uint64_t(code) << 32 | v;
        }
    });
    for (int shift = 32; shift < 62; shift += 10) { // stable, digit by digit
        std::array<size_t, 1025> first{};
        for (const uint64_t k : keys)
            first[(k >> shift & 1023) + 1]++;
        for (size_t d = 1; d < first.size(); d++)
            first[d] += first[d - 1];
        for (const uint64_t k : keys)
            other[first[k >> shift & 1023]++] = k;
        keys.swap(other);
    }
    m_order.resize(n);
    for (size_t i = 0; i < n; i++)
        m_order[i] = uint32_t(keys[i]);
}

// Numbers of a mesh's vertices in a patch.
class MeshPatches::Lookup {
  public:
    static constexpr uint32_t None = ~0u;
    explicit Lookup(size_t expected) { grow(expected); }
    // The number of v, or None and it gets `number`.
    uint32_t add(uint32_t v, uint32_t number) {
        if (2 * (m_size + 1) > m_keys.size())
            grow(m_size * 2);
        const size_t at = place(v);
        if (m_keys[at] == v)
            return m_values[at];
        m_keys[at] = v, m_values[at] = number, m_size++;
        return None;
    }
    uint32_t find(uint32_t v) const {
        const size_t at = place(v);
        return m_keys[at] == v ? m_values[at] : None;
    }

  private:
    size_t place(uint32_t v) const {
        size_t at = (v * 2654435769u) & (m_keys.size() - 1); // Knuth's multiplicative hash
        while (m_keys[at] != None && m_keys[at] != v)
            at = (at + 1) & (m_keys.size() - 1);
        return at;
    }
    void grow(size_t expected) {
        const std::vector<uint32_t> keys = std::move(m_keys), values = std::move(m_values);
        size_t room = 1024;
        while (room < 4 * expected)
            room *= 2;
        m_keys.assign(room, None), m_values.assign(room, 0);
        for (size_t i = 0; i < keys.size(); i++)
            if (keys[i] != None) {
                const size_t at = place(keys[i]);
                m_keys[at] = keys[i], m_values[at] = values[i];
            }
    }
    std::vector<uint32_t> m_keys, m_values;
    size_t m_size = 0;
};

void MeshPatches::add_neighbours(std::vector<uint32_t>& vertices, size_t begin, size_t end,
                                 Lookup& lookup) const {
    if (!m_goes_on.empty()) {
        for (size_t i = begin; i < end; i++)
            for (const uint32_t other : {before(vertices[i]), after(vertices[i])})
                if (lookup.add(other, uint32_t(vertices.size())) == Lookup::None && other != vertices[i])
                    vertices.push_back(other);
        return;
    }
    for (size_t i = begin; i < end; i++)
        for (uint32_t at = m_first_face[vertices[i]]; at < m_first_face[vertices[i] + 1]; at++) {
            const uint32_t f = m_face[at];
            const uint32_t* q = &m_mesh.indices[size_t(f) * size_t(m_mesh.vertices_per_face)];
            for (int k = 0; k < corners(f); k++)
                if (lookup.add(q[k], uint32_t(vertices.size())) == Lookup::None)
                    vertices.push_back(q[k]);
        }
}

// The edges at a vertex, and its weights.
class MeshPatches::Ring {
  public:
    explicit Ring(const MeshPatches& patches) : m_patches(patches) {}

    // Appends the stencil of mesh vertex v.
    void stencil(uint32_t v, const Lookup& lookup, Stencils& out) {
        if (!m_patches.m_goes_on.empty())
            return fibre(v, lookup, out);
        collect(v);
        const Vec3f n = normal(), u = of(m_patches.m_grid.dPdu, v), w = of(m_patches.m_grid.dPdv, v);
        float step_u = 0, step_v = 0;
        if (!(n == Vec3f(0.0f)))
            weigh(n, u, w, lookup, out, step_u, step_v);
        out.step_u.push_back(step_u), out.step_v.push_back(step_v);
        out.first.push_back(uint32_t(out.vertex.size()));
    }

  private:
    struct Edge {
        uint32_t vertex;
        Vec3f d;
        float count; // of faces that it is a side of
    };
    Vec3f of(const std::vector<float>& a, uint32_t v) const {
        const size_t n = m_patches.m_stride;
        return {a[v], a[v + n], a[v + 2 * n]};
    }
    // Along a fibre v grows from vertex to vertex; across it, u goes over the whole of it.
    void fibre(uint32_t v, const Lookup& lookup, Stencils& out) {
        const uint32_t a = m_patches.before(v), b = m_patches.after(v);
        const float share = a != v && b != v ? 0.5f : 1.0f;
        for (const auto& [other, sign] : {std::pair{a, -share}, std::pair{b, share}})
            if (other != v) {
                out.vertex.push_back(lookup.find(other));
                out.along_u.push_back(0), out.along_v.push_back(sign);
            }
        const float l = length(of(m_patches.m_grid.dPdv, v));
        out.step_u.push_back(1);
        out.step_v.push_back(l > 0 ? share * length(m_patches.rest(b) - m_patches.rest(a)) / l : 0);
        out.first.push_back(uint32_t(out.vertex.size()));
    }
    static Vec3f unit(const Vec3f& v) {
        const float l = length(v);
        return l > 0 && std::isfinite(l) ? v * (1 / l) : Vec3f(0.0f);
    }

    void collect(uint32_t v) {
        m_edges.clear();
        m_area = m_first = Vec3f(0.0f);
        m_faces = 0;
        const Vec3f p = m_patches.rest(v);
        const TracedMesh& mesh = m_patches.m_mesh;
        for (uint32_t at = m_patches.m_first_face[v]; at < m_patches.m_first_face[v + 1]; at++) {
            const uint32_t f = m_patches.m_face[at];
            const uint32_t* q = &mesh.indices[size_t(f) * size_t(mesh.vertices_per_face)];
            const int n = m_patches.corners(f);
            const Vec3f a = m_patches.rest(q[0]), b = m_patches.rest(q[1]), c = m_patches.rest(q[2]);
            const Vec3f along = n == 4 ? c - a : b - a, across = n == 4 ? m_patches.rest(q[3]) - b : c - a;
            const Vec3f area = cross(along, across) * (n == 4 ? 0.5f : 1.0f);
            if (!spans(along, across))
                continue;
            m_area += area;
            if (m_faces++ == 0)
                m_first = area;
            for (int k = 0; k < n; k++)
                if (q[k] == v) {
                    add(q[(k + 1) % n], p);
                    add(q[(k + n - 1) % n], p);
                }
        }
    }
    void add(uint32_t other, const Vec3f& p) {
        for (Edge& e : m_edges)
            if (e.vertex == other) {
                e.count++;
                return;
            }
        m_edges.push_back({other, m_patches.rest(other) - p, 1});
    }
    // Sheets that lie back to back have none together: then it is that of the first face.
    Vec3f normal() {
        if (m_faces == 0)
            return Vec3f(0.0f);
        m_area = m_area * (1 / float(m_faces));
        if (!(length_squared(m_area) > 1e-6f * length_squared(m_first)))
            m_area = m_first;
        return unit(m_area);
    }

    void weigh(const Vec3f& n, const Vec3f& dPdu, const Vec3f& dPdv, const Lookup& lookup, Stencils& out,
               float& step_u, float& step_v) {
        Vec3f x = unit(dPdu - n * dot(n, dPdu)), y = unit(dPdv - n * dot(n, dPdv));
        if (x == Vec3f(0.0f))
            x = y == Vec3f(0.0f) ? unit(m_edges[0].d - n * dot(n, m_edges[0].d)) : cross(y, n);
        const Vec3f across = cross(n, x);
        float cosine = dot(x, y), sine = dot(across, y);
        if (!(std::abs(sine) > 1e-3f)) // the two lie along each other, at a pole
            y = across, cosine = 0, sine = 1;
        float mean = 0;
        for (const Edge& e : m_edges)
            mean += length_squared(e.d);
        mean /= float(m_edges.size());
        // M = sum of w d d^T; the gradient is the sum of M^-1 w d_k (q_k - q).
        float aa = 0, ab = 0, bb = 0, pp = 0, qq = 0;
        for (const Edge& e : m_edges) {
            const float a = dot(e.d, x), b = dot(e.d, across), w = weight(e, mean);
            aa += w * a * a, ab += w * a * b, bb += w * b * b;
            const float q = b / sine, p = a - q * cosine;
            pp += e.count * p * p, qq += e.count * q * q;
        }
        const float trace = aa + bb, det = aa * bb - ab * ab;
        if (!(trace > 0))
            return;
        const bool line = !(det > 1e-6f * trace * trace); // all along one line: the pseudoinverse
        const float scale = line ? 1 / (trace * trace) : 1 / det;
        const float ia = line ? aa : bb, ib = line ? ab : -ab, ic = line ? bb : aa;
        const float ratio = std::clamp(std::sqrt(pp / std::max(qq, 1e-30f)), 1e-3f, 1e3f);
        const float area = length(m_area) / std::abs(sine);
        const float reach_x = std::sqrt(area * ratio), reach_y = std::sqrt(area / ratio);
        for (const Edge& e : m_edges) {
            const float a = dot(e.d, x), b = dot(e.d, across), w = weight(e, mean) * scale;
            const float gx = w * (ia * a + ib * b), gy = w * (ib * a + ic * b);
            out.vertex.push_back(lookup.find(e.vertex));
            out.along_u.push_back(reach_x * gx);
            out.along_v.push_back(reach_y * (gx * cosine + gy * sine));
        }
        const float lu = length(dPdu), lv = length(dPdv);
        step_u = lu > 0 ? reach_x / lu : 0;
        step_v = lv > 0 ? reach_y / lv : 0;
    }
    static float weight(const Edge& e, float mean) { return 1 / (length_squared(e.d) + 1e-2f * mean); }

    const MeshPatches& m_patches;
    std::vector<Edge> m_edges;
    Vec3f m_area, m_first;
    int m_faces = 0;
};

void MeshPatches::cut(size_t patch, Grid& out, std::vector<uint32_t>& vertices) const {
    const size_t begin = patch * Own, own = std::min(Own, m_order.size() - begin);
    vertices.assign(m_order.begin() + ptrdiff_t(begin), m_order.begin() + ptrdiff_t(begin + own));
    Lookup lookup(m_rings > 0 ? own + own / 2 : 0);
    for (size_t i = 0; i < own && m_rings > 0; i++)
        lookup.add(vertices[i], uint32_t(i));
    size_t from = 0, inner = 0; // inner: vertices that have all of their neighbours
    for (int r = 0; r < m_rings; r++) {
        inner = vertices.size();
        add_neighbours(vertices, from, inner, lookup);
        from = inner;
    }
    auto stencils = std::make_shared<Stencils>();
    stencils->own = int(own);
    stencils->first.reserve(vertices.size() + 1);
    for (auto* a : {&stencils->along_u, &stencils->along_v})
        a->reserve(6 * inner);
    stencils->vertex.reserve(6 * inner);
    stencils->first.push_back(0);
    Ring ring(*this);
    for (size_t i = 0; i < inner; i++)
        ring.stencil(vertices[i], lookup, *stencils);
    stencils->first.resize(vertices.size() + 1, uint32_t(stencils->vertex.size()));
    stencils->step_u.resize(vertices.size()), stencils->step_v.resize(vertices.size());

    out.allocate(int(vertices.size()) - 1, 0);
    out.face = m_grid.face;
    out.flips = m_grid.flips;
    out.facets = m_grid.facets;
    out.stencils = std::move(stencils);
    const auto gather = [&](const std::vector<float>& a, std::vector<float>& to, size_t components) {
        for (size_t c = 0; c < components; c++) {
            const float* x = a.data() + c * m_stride;
            float* y = to.data() + c * size_t(out.stride);
            for (size_t i = 0; i < vertices.size(); i++)
                y[i] = x[vertices[i]];
        }
    };
    for (auto array : {&Grid::P, &Grid::N, &Grid::Ng, &Grid::dPdu, &Grid::dPdv})
        gather(m_grid.*array, out.*array, 3);
    for (auto array : {&Grid::u, &Grid::v, &Grid::s, &Grid::t})
        gather(m_grid.*array, out.*array, 1);
    out.primvars.clear();
    for (const Channel& c : m_grid.primvars) {
        Channel& to = out.primvars.emplace_back(Channel{c.name, c.components, out.stride, {}});
        to.data.resize(size_t(c.components) * size_t(out.stride));
        gather(c.data, to.data, size_t(c.components));
    }
}

// ---- what was shaded

void MeshInputs::spread(SlotValues& slot, size_t components) {
    slot.uniform = false;
    slot.data.resize(components * size_t(m_whole.stride));
    for (size_t c = 0; c < components; c++)
        std::fill_n(slot.data.begin() + ptrdiff_t(c * size_t(m_whole.stride)), m_whole.stride,
                    slot.value[int(c)]);
}

void MeshInputs::add(const VertexInputs& from, const std::vector<uint32_t>& vertices, size_t own,
                     VertexInputs& to) {
    to.stride = m_whole.stride;
    to.variants.resize(from.variants.size());
    add(from.slots, from.stride, vertices, own, to.slots);
    for (size_t k = 0; k < from.variants.size(); k++)
        add(from.variants[k], from.stride, vertices, own, to.variants[k]);
}

void MeshInputs::add(const std::vector<SlotValues>& from, int stride, const std::vector<uint32_t>& vertices,
                     size_t own, std::vector<SlotValues>& to) {
    if (to.empty()) {
        to = from;
        for (SlotValues& slot : to)
            if (!slot.uniform)
                spread(slot, slot.data.size() / size_t(stride));
    }
    for (size_t k = 0; k < to.size(); k++) {
        const SlotValues& in = from[k];
        SlotValues& out = to[k];
        if (in.uniform && out.uniform && in.value == out.value)
            continue;
        if (out.uniform) // as many components as there may be
            spread(out, in.uniform ? 3 : in.data.size() / size_t(stride));
        const size_t components = out.data.size() / size_t(m_whole.stride),
                     given = in.uniform ? 3 : in.data.size() / size_t(stride);
        for (size_t c = 0; c < std::min(components, given); c++) {
            const float* x = in.uniform ? nullptr : in.data.data() + c * size_t(stride);
            float* y = out.data.data() + c * size_t(m_whole.stride);
            for (size_t i = 0; i < own; i++)
                y[vertices[i]] = x ? x[i] : in.value[int(c)];
        }
    }
}

} // namespace kanuka::grid
