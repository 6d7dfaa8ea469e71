#include "render/weld.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace kanuka::render {

namespace {

using R = store::ShapeRecord;

// Steps of an edge and of the lattice, as ShapeRecord::steps has them.
int step_of(const R& s, int shift) {
    return 1 << (s.steps >> shift & 15);
}

} // namespace

geom::ColoredMesh Weld::run(int first, int count) {
    for (int shape = first; shape < first + count; shape++)
        look_at(shape);
    if (std::ranges::any_of(m_parts, &Part::fine)) {
        for (const Part& part : m_parts)
            note_edges(part);
        fill_segments();
    }
    for (const Part& part : m_parts)
        add(part);
    return finish();
}

void Weld::look_at(int shape) {
    const R& s = m_store.shapes()[size_t(shape)];
    Part part{shape, false, true, {}};
    const bool mesh = s.flags & R::Mesh;
    const int vertices = mesh ? s.mu : (s.mu + 1) * (s.mv + 1);
    part.traced.reserve(size_t(vertices));
    for (int v = 0; v < vertices; v++)
        part.traced.push_back(vertex_at(position(s, v)));
    part.outward = winds_outward(part);
    part.fine = !mesh && (s.nu > s.mu || s.nv > s.mv) && m_albedos.varies(shape);
    m_parts.push_back(std::move(part));
}

// Does cross(along u, along v), or the winding of its faces, point to the outside? Normals know, where it has
// them.
bool Weld::winds_outward(const Part& part) const {
    const R& s = m_store.shapes()[size_t(part.shape)];
    if (!(s.flags & R::HasNormals))
        return !(s.flags & R::Flips);
    const bool mesh = s.flags & R::Mesh;
    const int faces = mesh ? s.mv : s.mu * s.mv, every = std::max(1, faces / 64);
    double sum = 0;
    for (int f = 0; f < faces; f += every) {
        std::array<int, 3> traced, shaded;
        if (mesh) {
            const uint32_t* face = m_store.words(s) + s.indices + f * (s.flags & R::Quads ? 4 : 3);
            for (size_t k = 0; k < 3; k++)
                traced[k] = shaded[k] = int(face[s.flags & R::Quads && k == 2 ? 3 : k]);
        } else {
            const int i = f % s.mu, j = f / s.mu, at = j * (s.mu + 1) + i;
            const int step_u = step_of(s, 0), step_v = step_of(s, 4);
            traced = {at, at + 1, at + s.mu + 1};
            shaded = {j * step_v * (s.nu + 1) + i * step_u, 0, 0};
        }
        const Vec3f p = position(s, traced[0]);
        const Vec3f n = cross(position(s, traced[1]) - p, position(s, traced[2]) - p);
        sum += double(dot(n, m_albedos.normal(part.shape, shaded[0])));
    }
    return sum >= 0;
}

Weld::Side Weld::side_of(const R& s, int edge) {
    const bool along_u = edge == grid::VMin || edge == grid::VMax,
               high = edge == grid::VMax || edge == grid::UMax;
    Side side{};
    side.cells = along_u ? s.nu : s.nv;
    side.traced = along_u ? s.mu : s.mv;
    side.step = step_of(s, along_u ? 0 : 4);
    side.spacing = step_of(s, 8 + 4 * edge);
    side.stride = along_u ? 1 : s.mu + 1;
    side.shaded_stride = along_u ? 1 : s.nu + 1;
    side.offset = !high ? 0 : along_u ? s.mv * (s.mu + 1) : s.mu;
    side.shaded_at = !high ? 0 : along_u ? s.nv * (s.nu + 1) : s.nu;
    side.high = high;
    return side;
}

void Weld::note_edges(const Part& part) {
    const R& s = m_store.shapes()[size_t(part.shape)];
    if (!(s.flags & R::Mesh)) {
        for (int edge = 0; edge < 4; edge++)
            note_segments(part, side_of(s, edge));
        return;
    }
    const int corners = s.flags & R::Quads ? 4 : 3;
    const uint32_t* face = m_store.words(s) + s.indices;
    for (int f = 0; f < s.mv; f++, face += corners)
        for (int k = 0; k < corners; k++) {
            const uint32_t a = part.traced[face[k]], b = part.traced[face[(k + 1) % corners]];
            m_segments[{std::min(a, b), std::max(a, b)}] = {1};
        }
}

void Weld::note_segments(const Part& part, const Side& side) {
    for (int a = 0; a < side.cells; a += side.spacing) {
        const int b = std::min(a + side.spacing, side.cells);
        const auto at = [&](int cell) {
            return part.traced[size_t(side.offset + std::min(cell / side.step, side.traced) * side.stride)];
        };
        const uint32_t p = at(a), q = at(b);
        if (p == q)
            continue;
        const int pieces =
            part.fine ? (b - a) & (a - b) : 1; // a power of two: of two numbers one divides the other
        const auto [found, is_new] =
            m_segments.try_emplace({std::min(p, q), std::max(p, q)}, Segment{pieces});
        if (!is_new)
            found->second.pieces = std::min(found->second.pieces, pieces);
    }
}

void Weld::fill_segments() {
    for (auto& [ends, segment] : m_segments) {
        segment.first = uint32_t(m_mesh.points.size());
        const Vec3f p = m_mesh.points[ends[0]], q = m_mesh.points[ends[1]];
        for (int k = 1; k < segment.pieces; k++)
            new_vertex(lerp(float(k) / float(segment.pieces), p, q));
    }
}

void Weld::add(const Part& part) {
    const R& s = m_store.shapes()[size_t(part.shape)];
    if (s.flags & R::Mesh)
        return add_mesh(part);
    if (part.fine)
        return add_fine_grid(part);
    const bool varies = m_albedos.varies(part.shape);
    const int step_u = step_of(s, 0), step_v = step_of(s, 4);
    const Rgb all = varies ? Rgb(0.0f) : m_albedos.at(part.shape, 0);
    for (int j = 0; j <= s.mv; j++)
        for (int i = 0; i <= s.mu; i++)
            color(part.traced[size_t(j * (s.mu + 1) + i)],
                  varies ? m_albedos.at(part.shape, j * step_v * (s.nu + 1) + i * step_u) : all);
    for (int j = 0; j < s.mv; j++)
        for (int i = 0; i < s.mu; i++) {
            const uint32_t* v = part.traced.data() + j * (s.mu + 1) + i;
            face(part, v[0], v[1], v[s.mu + 1]);
            face(part, v[s.mu + 2], v[s.mu + 1], v[1]);
        }
}

void Weld::add_mesh(const Part& part) {
    const R& s = m_store.shapes()[size_t(part.shape)];
    const bool quads = s.flags & R::Quads, varies = m_albedos.varies(part.shape);
    const int corners = quads ? 4 : 3;
    const Rgb all = varies ? Rgb(0.0f) : m_albedos.at(part.shape, 0);
    std::vector<char> seen(part.traced.size());
    const uint32_t* f = m_store.words(s) + s.indices;
    for (int i = 0; i < s.mv; i++, f += corners) {
        for (int k = 0; k < corners; k++)
            if (!std::exchange(seen[f[k]], 1))
                color(part.traced[f[k]], varies ? m_albedos.at(part.shape, int(f[k])) : all);
        const auto v = [&](int k) { return part.traced[f[k]]; };
        face(part, v(0), v(1), v(quads ? 3 : 2));
        if (quads)
            face(part, v(2), v(3), v(1));
    }
}

void Weld::add_fine_grid(const Part& part) {
    const R& s = m_store.shapes()[size_t(part.shape)];
    const std::vector<uint32_t> vertices = fine_vertices(part);
    for (int j = 0; j < s.nv; j++)
        for (int i = 0; i < s.nu; i++) {
            const uint32_t* v = vertices.data() + j * (s.nu + 1) + i;
            face(part, v[0], v[1], v[s.nu + 1]);
            face(part, v[s.nu + 2], v[s.nu + 1], v[1]);
        }
}

// By shading vertex; those of its sides go to the nearest on the polyline.
std::vector<uint32_t> Weld::fine_vertices(const Part& part) {
    const R& s = m_store.shapes()[size_t(part.shape)];
    const int step_u = step_of(s, 0), step_v = step_of(s, 4);
    std::vector<uint32_t> vertices(size_t((s.nu + 1) * (s.nv + 1)));
    for (int j = 1; j < s.nv; j++)
        for (int i = 1; i < s.nu; i++) {
            const int at = j * (s.nu + 1) + i;
            const bool is_traced = i % step_u == 0 && j % step_v == 0;
            const uint32_t v = is_traced ? part.traced[size_t(j / step_v * (s.mu + 1) + i / step_u)]
                                         : new_vertex(on_traced(part, i, j));
            vertices[size_t(at)] = v;
            color(v, m_albedos.at(part.shape, at));
        }
    for (int edge = 0; edge < 4; edge++)
        put_side(part, side_of(s, edge), vertices);
    return vertices;
}

void Weld::put_side(const Part& part, const Side& side, std::vector<uint32_t>& vertices) {
    for (int i = 0; i <= side.cells; i++) {
        const int a = std::min(i, side.cells - 1) / side.spacing * side.spacing,
                  b = std::min(a + side.spacing, side.cells);
        const auto traced = [&](int cell) {
            return part.traced[size_t(side.offset + std::min(cell / side.step, side.traced) * side.stride)];
        };
        const uint32_t p = traced(a), q = traced(b);
        uint32_t v = p;
        int to = i;
        if (p != q) {
            const Segment& segment = m_segments.at({std::min(p, q), std::max(p, q)});
            // dice/split.h, nearest_kept()
            const int cells = (b - a) / segment.pieces, rest = (i - a) % cells;
            int k = (i - a) / cells;
            k += 2 * rest > cells || (2 * rest == cells && 2 * i + int(side.high) > side.cells);
            to = a + k * cells;
            const int from_lower = p < q ? k : segment.pieces - k;
            v = k == 0 ? p : k == segment.pieces ? q : segment.first + uint32_t(from_lower) - 1;
        }
        const int at = side.shaded_at + i * side.shaded_stride;
        vertices[size_t(at)] = v;
        if (to == i)
            color(v, m_albedos.at(part.shape, at));
    }
}

// Of a shading vertex, where its traced triangle has it.
Vec3f Weld::on_traced(const Part& part, int i, int j) const {
    const R& s = m_store.shapes()[size_t(part.shape)];
    const int step_u = step_of(s, 0), step_v = step_of(s, 4);
    const int ti = std::min(i / step_u, s.mu - 1), tj = std::min(j / step_v, s.mv - 1);
    const float fx = float(i - ti * step_u) / float(step_u), fy = float(j - tj * step_v) / float(step_v);
    const int at = tj * (s.mu + 1) + ti;
    const Vec3f p10 = position(s, at + 1), p01 = position(s, at + s.mu + 1);
    if (fx + fy > 1) {
        const Vec3f p11 = position(s, at + s.mu + 2);
        return p11 + (p01 - p11) * (1 - fx) + (p10 - p11) * (1 - fy);
    }
    const Vec3f p00 = position(s, at);
    return p00 + (p10 - p00) * fx + (p01 - p00) * fy;
}

uint32_t Weld::vertex_at(const Vec3f& p) {
    const auto bits = [](float x) { return std::bit_cast<uint32_t>(x + 0.0f); }; // of zeros there is one
    const auto [found, is_new] =
        m_vertices.try_emplace({bits(p.x), bits(p.y), bits(p.z)}, uint32_t(m_mesh.points.size()));
    return is_new ? new_vertex(p) : found->second;
}

uint32_t Weld::new_vertex(const Vec3f& p) {
    m_mesh.points.push_back(p);
    m_mesh.colors.push_back(Rgb(0.0f));
    m_colors.push_back(0);
    return uint32_t(m_mesh.points.size() - 1);
}

void Weld::color(uint32_t vertex, const Rgb& rgb) {
    m_mesh.colors[vertex] += rgb;
    m_colors[vertex]++;
}

void Weld::face(const Part& part, uint32_t a, uint32_t b, uint32_t c) {
    if (a == b || b == c || c == a)
        return;
    for (const uint32_t corner : {a, b, c}) {
        const Vec3f& p = m_mesh.points[corner];
        if (!std::isfinite(p.x + p.y + p.z)) {
            m_nowhere++;
            return;
        }
    }
    if (!part.outward)
        std::swap(b, c);
    m_mesh.triangles.insert(m_mesh.triangles.end(), {a, b, c});
}

// Where grids lie so flat to the view that they are lines, faces lie on their backs: both are nothing.
void Weld::drop_folded_lines() {
    auto& t = m_mesh.triangles;
    std::map<std::array<uint32_t, 3>, std::vector<size_t>> lines; // faces by their corners
    for (size_t f = 0; f < t.size(); f += 3) {
        const Vec3f p = m_mesh.points[t[f]], a = m_mesh.points[t[f + 1]] - p, b = m_mesh.points[t[f + 2]] - p;
        const float longest = std::max({dot(a, a), dot(b, b), dot(b - a, b - a)});
        if (length(cross(a, b)) > 1e-4f * longest)
            continue;
        std::array<uint32_t, 3> corners{t[f], t[f + 1], t[f + 2]};
        std::ranges::sort(corners);
        lines[corners].push_back(f);
    }
    for (const auto& [corners, faces] : lines) {
        std::vector<size_t> ways[2]; // that they wind
        for (const size_t f : faces) {
            const auto at = size_t(std::find(&t[f], &t[f] + 3, corners[0]) - &t[f]);
            ways[t[f + (at + 1) % 3] == corners[1]].push_back(f);
        }
        const size_t pairs = std::min(ways[0].size(), ways[1].size());
        for (const std::vector<size_t>& way : ways)
            for (size_t i = 0; i < pairs; i++)
                t[way[i] + 1] = t[way[i]]; // finish() leaves it out
    }
}

// Vertices that no face has go.
geom::ColoredMesh Weld::finish() {
    for (size_t v = 0; v < m_colors.size(); v++)
        if (m_colors[v] > 1)
            m_mesh.colors[v] *= 1.0f / float(m_colors[v]);
    drop_folded_lines();
    return geom::Decimation().after(m_mesh, 0);
}

} // namespace kanuka::render
