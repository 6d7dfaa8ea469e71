#include "store/encode_grid.h"

#include <algorithm>
#include <atomic>

#include "color/photometry.h"
#include "grid/lobe_table.h"
#include "store/quantize.h"

namespace kanuka::store {

namespace {

using grid::InputType;
using grid::LayerOp;
using grid::LobeId;
using grid::WordLayout;

uint32_t bits_of(float f) {
    uint32_t b;
    std::memcpy(&b, &f, 4);
    return b;
}

float log2_step(int step) {
    return float(__builtin_ctz(unsigned(step)));
}

class GridEncoder {
  public:
    GridEncoder(const ShadedGrid& shaded, const grid::LayeringProgram& program, const WordLayout& layout,
                const color::Palette& palette, Encoded& out)
        : m_shaded(shaded), m_grid(*shaded.grid), m_program(program), m_layout(layout), m_palette(palette),
          m_out(out), m_count(m_grid.vertices()) {}

    void run() {
        encode_geometry();
        for (size_t w = 0; w < m_layout.words.size(); w++)
            encode_word(w);
        encode_normals();
        if (m_shaded.smooth && is_coarse())
            m_out.shape.flags |= ShapeRecord::Rounded;
        if (m_program.opacity[0] >= 0 && is_tinted())
            m_out.shape.flags |= ShapeRecord::Tinted;
        if (m_program.needs_tangent())
            encode_tangents();
        if (m_program.emits())
            encode_emitters();
        else
            m_out.shape.emitter = -1;
    }

  private:
    // Into the slot's range and to what half precision holds. Infinity lies in the range of an unbounded
    // slot, but one infinite radiance would be the whole picture's.
    float clean(float x, const grid::Slot& slot, float most = LargestHalf) {
        if (slot.storage == grid::Storage::Full) {
            m_out.bad += !std::isfinite(x);
            return std::isfinite(x) ? x : 0.0f;
        }
        if (slot.between == grid::Between::Turns)
            x -= std::floor(x);
        const float low = std::max(slot.low, -most), high = std::min(slot.high, most);
        if (x >= low && x <= high)
            return x;
        m_out.bad += !std::isfinite(x);
        m_out.lost += std::isfinite(x) && std::abs(x) > most && slot.high > most;
        return std::isnan(x) ? std::clamp(0.0f, low, high)
                             : std::clamp(x, low, std::isfinite(x) ? high : std::min(high, LargestHalf));
    }

    // `most`: emitters keep whole floats.
    float value(int slot, int component, int vertex, float most = LargestHalf) {
        const grid::SlotValues& values = m_shaded.inputs->slots[slot];
        const float x = values.uniform ? values.value[component]
                                       : values.data[size_t(component) * m_shaded.inputs->stride + vertex];
        return clean(x, m_program.slots[slot], most);
    }

    bool constant(int slot) const {
        const grid::SlotValues& values = m_shaded.inputs->slots[slot];
        if (values.uniform)
            return true;
        const int components = m_program.slots[slot].type == InputType::Color ? 3 : 1;
        for (int c = 0; c < components; c++) {
            const float* a = values.data.data() + size_t(c) * m_shaded.inputs->stride;
            for (int i = 1; i < m_count; i++)
                if (bits_of(a[i]) != bits_of(a[0]))
                    return false;
        }
        return true;
    }

    Rgb color(int slot, int i) { return {value(slot, 0, i), value(slot, 1, i), value(slot, 2, i)}; }

    // Does it stop some colours more than others?
    bool is_tinted() {
        const auto& c = m_program.opacity;
        for (int i = 0; i < m_count; i++) {
            const float r = value(c[0], 0, i), g = value(c[1], 0, i), b = value(c[2], 0, i);
            if (std::max({r, g, b}) - std::min({r, g, b}) > 1e-3f)
                return true;
        }
        return false;
    }

    // Is it read for emitters alone, which keep whole floats? Its word is what fits.
    bool is_emission(int slot) const {
        return std::ranges::any_of(m_program.nodes, [&](const grid::LayerNode& n) {
            return n.op == LayerOp::Lobe && grid::lobe(n.lobe).kind == grid::LobeKind::Emission &&
                   (n.weight == slot || std::ranges::find(n.inputs, slot) != n.inputs.end());
        });
    }

    void encode_word(size_t w) {
        const auto [low, high] = m_layout.slots_of_word[w];
        const uint64_t lost = m_out.lost;
        const bool folds = constant(low) && (high < 0 || constant(high));
        m_out.table.push_back(uint32_t(m_out.inputs.size()));
        m_out.table.push_back(folds ? 0 : 1);
        auto& out = m_out.inputs;
        if (folds && m_layout.words[w] == WordLayout::Word::HalfPair) {
            out.push_back(bits_of(value(low, 0, 0)));
            out.push_back(bits_of(high < 0 ? 0.0f : value(high, 0, 0)));
        } else if (folds && m_layout.words[w] == WordLayout::Word::Float) {
            out.push_back(bits_of(value(low, 0, 0)));
        } else if (folds) {
            // Reflectances lie in [0, 1]; amounts without bound are scaled into it, twice their maximum to
            // keep the spectrum smooth.
            const Rgb rgb = color(low, 0);
            const float m = std::max({rgb.x, rgb.y, rgb.z});
            const float scale = m_layout.words[w] == WordLayout::Word::Amount && m > 0 ? 2 * m : 1;
            for (float f : m_palette.reflectance(rgb, scale))
                out.push_back(bits_of(f));
        } else {
            const size_t base = out.size();
            out.resize(base + m_count);
            for (int i = 0; i < m_count; i++) {
                switch (m_layout.words[w]) {
                case WordLayout::Word::Color:
                case WordLayout::Word::Amount:
                    out[base + i] = to_rgb9e5(color(low, i));
                    break;
                case WordLayout::Word::Float:
                    out[base + i] = bits_of(value(low, 0, i));
                    break;
                case WordLayout::Word::HalfPair:
                    out[base + i] =
                        to_half(value(low, 0, i)) | uint32_t(high < 0 ? 0 : to_half(value(high, 0, i))) << 16;
                    break;
                }
            }
        }
        if (is_emission(low) && (high < 0 || is_emission(high)))
            m_out.lost = lost; // emitters have the whole of it
    }

    // Unit length, or zero where there is none to be had.
    static Vec3f unit(const Vec3f& n) {
        const float largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
        return largest > 0 && std::isfinite(n.x + n.y + n.z) ? normalize(n * (1 / largest)) : Vec3f(0.0f);
    }

    Vec3f later_normal(size_t step, int i) const {
        const std::vector<float>& n = m_grid.later[step].N;
        return {n[size_t(i)], n[size_t(m_grid.stride + i)], n[size_t(2 * m_grid.stride + i)]};
    }

    // Vertices without a usable normal (poles, NaN) take that of the vertex before; the first ones, that of
    // the first that has one.
    void encode_normals() {
        if (m_out.shape.flags & ShapeRecord::Fibre) { // the fibre has its own
            m_out.table.push_back(uint32_t(m_out.inputs.size()));
            m_out.table.push_back(0);
            m_out.inputs.resize(m_out.inputs.size() + 3 * (m_grid.later.size() + 1), 0);
            m_normals.assign(1, Vec3f(0, 0, 1));
            return;
        }
        std::vector<Vec3f> normals(size_t(m_count), Vec3f(0.0f));
        Vec3f last(0.0f);
        bool flat = true, given = false;
        for (int i = 0; i < m_count; i++) {
            const Vec3f raw = m_grid.normal(i);
            normals[size_t(i)] = unit(raw);
            flat &= raw == m_grid.normal(0);
            given |= !(raw == Vec3f(0.0f));
            if (last == Vec3f(0.0f))
                last = normals[size_t(i)];
        }
        for (size_t k = 0; k < m_grid.later.size() && flat; k++)
            for (int i = 0; i < m_count && flat; i++)
                flat = later_normal(k, i) == later_normal(k, 0);
        const bool usable = !(last == Vec3f(0.0f));
        flat |= !usable;
        m_out.table.push_back(uint32_t(m_out.inputs.size()));
        m_out.table.push_back(flat ? 0 : 1);
        if (usable)
            m_out.shape.flags |= ShapeRecord::HasNormals;
        else if (given)
            m_out.bad += uint64_t(m_count);
        if (flat) {
            if (usable)
                m_out.shape.flags |= ShapeRecord::FlatNormal;
            for (float f : {last.x, last.y, last.z})
                m_out.inputs.push_back(bits_of(f));
            for (size_t k = 0; k < m_grid.later.size(); k++) {
                const Vec3f n = unit(later_normal(k, 0)), kept = n == Vec3f(0.0f) ? last : n;
                for (float f : {kept.x, kept.y, kept.z})
                    m_out.inputs.push_back(bits_of(f));
            }
            m_normals.assign(1, last);
            return;
        }
        for (Vec3f& n : normals) {
            if (n == Vec3f(0.0f))
                m_out.bad++;
            else
                last = n;
            n = last;
            m_out.inputs.push_back(to_oct32(n));
        }
        for (size_t k = 0; k < m_grid.later.size(); k++)
            for (int i = 0; i < m_count; i++) {
                const Vec3f n = unit(later_normal(k, i));
                m_out.inputs.push_back(to_oct32(n == Vec3f(0.0f) ? normals[size_t(i)] : n));
            }
        m_normals = std::move(normals);
    }

    // Does a normal lean farther from its facet than dicing lets it?
    bool is_coarse() const {
        constexpr float LeastCosine = 0.9976f; // 4 degrees
        const ShapeRecord& s = m_out.shape;
        if (!(s.flags & ShapeRecord::HasNormals) || m_normals.size() == 1 || s.motion_segments > 0 ||
            (s.flags & (ShapeRecord::Collapsed | ShapeRecord::Fibre)))
            return false;
        // Of traced corners, with their vertices.
        const auto leans = [&](const std::array<int, 3>& traced, const std::array<int, 3>& vertex) {
            const auto at = [&](int v) {
                const float* p = m_out.positions.data() + size_t(v) * 3;
                return Vec3f(p[0], p[1], p[2]);
            };
            const Vec3f n = unit(cross(at(traced[1]) - at(traced[0]), at(traced[2]) - at(traced[0])));
            for (const int v : vertex)
                if (!(n == Vec3f(0.0f)) && std::abs(dot(n, m_normals[size_t(v)])) < LeastCosine)
                    return true;
            return false;
        };
        if (m_shaded.mesh) {
            const int n = m_shaded.mesh->vertices_per_face;
            for (size_t f = 0; f < m_out.indices.size(); f += size_t(n)) {
                const auto corner = [&](int k) { return int(m_out.indices[f + size_t(k)]); };
                const std::array<int, 3> a{corner(0), corner(1), corner(n - 1)};
                if (leans(a, a))
                    return true;
                if (n == 4)
                    if (const std::array<int, 3> b{corner(2), corner(3), corner(1)}; leans(b, b))
                        return true;
            }
            return false;
        }
        const grid::TracedGrid& t = *m_shaded.traced;
        for (int j = 0; j < t.mv; j++)
            for (int i = 0; i < t.mu; i++) {
                const auto traced = [&](int a, int b) { return (j + b) * (t.mu + 1) + i + a; };
                const auto vertex = [&](int a, int b) {
                    return (j + b) * t.step_v * (s.nu + 1) + (i + a) * t.step_u;
                };
                if (leans({traced(0, 0), traced(1, 0), traced(0, 1)},
                          {vertex(0, 0), vertex(1, 0), vertex(0, 1)}) ||
                    leans({traced(1, 1), traced(0, 1), traced(1, 0)},
                          {vertex(1, 1), vertex(0, 1), vertex(1, 0)}))
                    return true;
            }
        return false;
    }

    // dPdu at every vertex; where there is none, some direction across the normal.
    void encode_tangents() {
        const auto raw = [&](int i) {
            const size_t at = size_t(i), n = size_t(m_grid.stride);
            return m_grid.dPdu.size() < 3 * n
                       ? Vec3f(0.0f)
                       : Vec3f(m_grid.dPdu[at], m_grid.dPdu[n + at], m_grid.dPdu[2 * n + at]);
        };
        const auto tangent = [&](int i) {
            const Vec3f t = unit(raw(i)), n = m_normals[m_normals.size() == 1 ? 0 : size_t(i)];
            if (!(t == Vec3f(0.0f)))
                return t;
            return unit(std::abs(n.x) < 0.9f ? cross(n, Vec3f(1, 0, 0)) : cross(n, Vec3f(0, 1, 0)));
        };
        bool same = true;
        for (int i = 1; i < m_count; i++)
            same &= raw(i) == raw(0);
        m_out.table.push_back(uint32_t(m_out.inputs.size()));
        m_out.table.push_back(same ? 0 : 1);
        if (same) {
            const Vec3f t = tangent(0);
            for (float f : {t.x, t.y, t.z})
                m_out.inputs.push_back(bits_of(f));
            return;
        }
        for (int i = 0; i < m_count; i++)
            m_out.inputs.push_back(to_oct32(tangent(i)));
    }

    void encode_geometry() {
        ShapeRecord& s = m_out.shape;
        s.links = 0;
        s.interior = -1;
        if (m_program.shines_both)
            s.flags |= ShapeRecord::ShinesBoth;
        s.motion_segments = int(m_grid.later.size());
        s.nu = m_grid.nu;
        s.nv = m_grid.nv;
        s.flags |= m_grid.flips ? ShapeRecord::Flips : 0;
        if (m_shaded.mesh) {
            const grid::TracedMesh& mesh = *m_shaded.mesh;
            const bool fibre = !mesh.radius.empty();
            s.flags |= ShapeRecord::Mesh | (mesh.vertices_per_face == 4 ? ShapeRecord::Quads : 0) |
                       (fibre ? ShapeRecord::Fibre : 0) |
                       (mesh.around && m_program.is_layer() ? ShapeRecord::Layer : 0);
            s.mu = m_count;
            s.mv = int(mesh.indices.size() / mesh.vertices_per_face);
            m_out.positions = interleaved(mesh.P.empty() ? m_grid.P : mesh.P, mesh.radius);
            for (size_t k = 0; k < m_grid.later.size(); k++)
                m_out.later.push_back(interleaved(
                    m_grid.later[k].P, k < mesh.later_radius.size() ? mesh.later_radius[k] : mesh.radius));
            m_out.indices = mesh.indices;
            return;
        }
        const grid::TracedGrid& t = *m_shaded.traced;
        s.mu = t.mu;
        s.mv = t.mv;
        s.steps = int(log2_step(t.step_u)) | int(log2_step(t.step_v)) << 4;
        for (int e = 0; e < 4; e++) {
            s.steps |= int(log2_step(t.edge_step[e])) << (8 + 4 * e);
            if (t.edge_step[e] > (e % 2 == 0 ? t.step_u : t.step_v))
                s.flags |= ShapeRecord::Collapsed;
        }
        m_out.positions.assign(t.P.begin(), t.P.begin() + size_t(t.mu + 1) * (t.mv + 1) * 3);
        m_out.later = t.later;
    }

    // With the radius behind each, if there are any.
    std::vector<float> interleaved(const std::vector<float>& p, const std::vector<float>& radius) const {
        const size_t each = radius.empty() ? 3 : 4;
        std::vector<float> out(size_t(m_count) * each);
        for (int i = 0; i < m_count; i++) {
            for (int c = 0; c < 3; c++)
                out[size_t(i) * each + size_t(c)] = p[size_t(c) * size_t(m_grid.stride) + size_t(i)];
            if (each == 4)
                out[size_t(i) * each + 3] = radius[size_t(i)];
        }
        return out;
    }

    // ---- emission

    // How much of what lies below a subtree covers, as bsdf::Material has it.
    float coverage(int node, int i) {
        const grid::LayerNode& n = m_program.nodes[size_t(node)];
        const float w = n.weight < 0 ? 1 : value(n.weight, 0, i);
        float c = w;
        switch (n.op) {
        case LayerOp::Lobe:
            break;
        case LayerOp::Mix:
            c = coverage(n.upper, i) * w + coverage(n.lower, i) * (1 - w);
            break;
        case LayerOp::Over:
        case LayerOp::Coat:
        case LayerOp::Thick: {
            const float upper = coverage(n.upper, i);
            c = upper * w + coverage(n.lower, i) * (1 - w * upper);
            break;
        }
        case LayerOp::Add:
            c = coverage(n.upper, i) + coverage(n.lower, i);
            break;
        }
        return std::min(c, 1.0f);
    }

    // Radiance of the tree below `node` at a vertex; coats are taken as clear.
    Rgb emission(int node, int i) {
        const grid::LayerNode& n = m_program.nodes[size_t(node)];
        const auto radiance = [&](int slot, int c, int v) {
            return value(slot, c, v, color::LargestRadiance);
        };
        const float w = n.weight < 0 ? 1 : radiance(n.weight, 0, i);
        switch (n.op) {
        case LayerOp::Lobe: {
            constexpr size_t Radiance = grid::EmissionRadiance;
            if (grid::lobe(n.lobe).kind != grid::LobeKind::Emission)
                return Rgb(0);
            const int slot = Radiance < n.inputs.size() ? n.inputs[Radiance] : -1;
            if (slot < 0)
                return count_shape(n, i, grid::lobe(n.lobe).inputs[Radiance].fallback * w);
            return count_shape(n, i,
                               Rgb(radiance(slot, 0, i), radiance(slot, 1, i), radiance(slot, 2, i)) * w);
        }
        case LayerOp::Mix:
            return emission(n.upper, i) * w + emission(n.lower, i) * (1 - w);
        case LayerOp::Over:
            return emission(n.upper, i) * w + emission(n.lower, i) * (1 - w * coverage(n.upper, i));
        case LayerOp::Coat:
        case LayerOp::Thick:
            return emission(n.upper, i) * w + emission(n.lower, i);
        case LayerOp::Add:
            return emission(n.upper, i) + emission(n.lower, i);
        }
        return Rgb(0);
    }

    // An emitter has one shape: the mean of its lobes' of the first one's kind, by their light.
    Rgb count_shape(const grid::LayerNode& n, int i, const Rgb& radiance) {
        const float light = std::max(color::luminance(radiance), 1e-12f);
        const auto mean = [&](int k) {
            const bool given = size_t(k) < n.inputs.size() && n.inputs[size_t(k)] >= 0;
            return light * (given ? value(n.inputs[size_t(k)], 0, i)
                                  : grid::lobe(n.lobe).inputs[size_t(k)].fallback.x);
        };
        if (n.lobe != m_program.emission()->lobe)
            return radiance;
        if (n.lobe == LobeId::ConeEmission) {
            m_shape_light += light;
            m_shape[0] += mean(grid::input_of(LobeId::ConeEmission, "angle"));
            m_shape[1] += mean(grid::input_of(LobeId::ConeEmission, "softness"));
        } else if (n.lobe == LobeId::ProfileEmission) {
            m_shape_light += light;
            m_shape[0] += mean(grid::input_of(LobeId::ProfileEmission, "exponent"));
        }
        return radiance;
    }
    EmissionShape shape_of_emitter() const {
        EmissionShape s;
        // An area light's cone bounds whatever its surface sends out.
        s.cos_outer = std::clamp(m_program.emission_cosine, 0.0f, 0.9999f);
        s.cos_inner = s.cos_outer;
        if (!(m_shape_light > 0))
            return s;
        const float first = m_shape[0] / m_shape_light, second = m_shape[1] / m_shape_light;
        if (m_program.emission()->lobe == LobeId::ProfileEmission) {
            s.exponent = first;
        } else {
            const auto cosine = [](float degrees) { return std::cos(degrees * (Pi / 180)); };
            s.cos_outer = std::max(s.cos_outer, std::clamp(cosine(first), 0.0f, 0.9999f));
            s.cos_inner = std::max(s.cos_outer, std::clamp(cosine(first * (1 - second)), 0.0f, 1.0f));
        }
        return s;
    }

    // Emits to the outside: where shading normals point, as a hit has it; without them, where the winding
    // says.
    bool emits_backwards(const Vec3f& cross_product, std::span<const int> vertex) const {
        if (!(m_out.shape.flags & ShapeRecord::HasNormals))
            return m_grid.flips;
        const auto normal = [&](int i) {
            return m_normals.size() == 1 ? m_normals[0] : m_normals[size_t(i)];
        };
        return dot(cross_product, normal(vertex[0]) + normal(vertex[1]) + normal(vertex[2])) < 0;
    }

    // Radiance of the vertices' mean.
    void add_emitter(const std::array<Vec3f, 3>& p, std::span<const int> vertex) {
        Emitter e{};
        e.p0 = p[0];
        e.e1 = p[1] - p[0];
        e.e2 = p[2] - p[0];
        const int root = int(m_program.nodes.size()) - 1;
        Rgb rgb(0);
        m_shape[0] = m_shape[1] = m_shape_light = 0;
        for (int i : vertex) {
            // A ray that comes by chance meets what is there alone; one that is sent here counts that part.
            const float presence = m_program.presence < 0 ? 1 : value(m_program.presence, 0, i);
            rgb += emission(root, i) * (presence / float(vertex.size()));
        }
        const float m = std::max({rgb.x, rgb.y, rgb.z});
        const auto c = m_palette.emission(m > 0 ? rgb : Rgb(0), 2 * m);
        e.c0 = c[0], e.c1 = c[1], e.c2 = c[2], e.scale = c[3];
        const Vec3f c2 = cross(e.e1, e.e2);
        e.area = 0.5f * length(c2);
        e.area = std::isfinite(e.area) ? e.area : 0;
        const EmissionShape shape = shape_of_emitter();
        e.power = e.area * std::max(color::luminance(rgb), 0.0f) * shape.sent();
        e.flags = uint32_t(emits_backwards(c2, vertex)) | shape.bits();
        m_out.emitters.push_back(e);
    }

    void encode_emitters() {
        m_out.shape.emitter = 0;
        const auto traced_point = [&](int v) {
            const float* p = m_out.positions.data() + size_t(v) * 3;
            return Vec3f(p[0], p[1], p[2]);
        };
        if (m_out.shape.flags & ShapeRecord::Fibre) {
            encode_shining_fibre();
            return;
        }
        if (m_shaded.mesh) {
            const int n = m_shaded.mesh->vertices_per_face;
            for (size_t f = 0; f < m_out.indices.size(); f += n) {
                const uint32_t* v = &m_out.indices[f];
                const auto add = [&](int a, int b, int c) {
                    const int vertex[] = {int(v[a]), int(v[b]), int(v[c])};
                    add_emitter({traced_point(v[a]), traced_point(v[b]), traced_point(v[c])}, vertex);
                };
                if (n == 3)
                    add(0, 1, 2);
                else {
                    add(0, 1, 3);
                    add(2, 3, 1);
                }
            }
            return;
        }
        const grid::TracedGrid& t = *m_shaded.traced;
        for (int j = 0; j < t.mv; j++)
            for (int i = 0; i < t.mu; i++) {
                // The ray tracer's split of a cell: (0,0) (1,0) (0,1) and (1,1) (0,1) (1,0).
                const auto traced = [&](int a, int b) { return traced_point((j + b) * (t.mu + 1) + i + a); };
                const auto shading = [&](int a, int b) {
                    return std::min((j + b) * t.step_v, m_grid.nv) * (m_grid.nu + 1) +
                           std::min((i + a) * t.step_u, m_grid.nu);
                };
                const int first[] = {shading(0, 0), shading(1, 0), shading(0, 1)},
                          second[] = {shading(1, 1), shading(0, 1), shading(1, 0)};
                add_emitter({traced(0, 0), traced(1, 0), traced(0, 1)}, first);
                add_emitter({traced(1, 1), traced(0, 1), traced(1, 0)}, second);
            }
    }

    // One a segment, which is met and never asked for: nobody can choose a place on it. Its area is the round
    // one.
    void encode_shining_fibre() {
        for (const uint32_t i : m_out.indices) {
            const float* p = m_out.positions.data() + size_t(i) * 4;
            const Vec3f begin(p[0], p[1], p[2]), end(p[4], p[5], p[6]);
            const int vertex[] = {int(i), int(i) + 1};
            add_emitter({begin, end, begin}, vertex);
            Emitter& e = m_out.emitters.back();
            e.area = Pi * (p[3] + p[7]) * length(end - begin);
            e.power = 0;
        }
    }

    const ShadedGrid& m_shaded;
    const grid::Grid& m_grid;
    const grid::LayeringProgram& m_program;
    const WordLayout& m_layout;
    const color::Palette& m_palette;
    Encoded& m_out;
    int m_count;
    float m_shape[2] = {0, 0}, m_shape_light = 0; // sums over an emitter's vertices and lobes
    std::vector<Vec3f> m_normals;                 // one if flat, none if there are none
};

} // namespace

void encode_grid(const ShadedGrid& shaded, const grid::LayeringProgram& program, const WordLayout& layout,
                 const color::Palette& palette, Encoded& out) {
    GridEncoder(shaded, program, layout, palette, out).run();
}

} // namespace kanuka::store
