// Emitters: triangles that shine, each with one radiance and one shape. docs/decisions/0005-emitters.md
#include "color/photometry.h"
#include "grid/lobe_table.h"
#include "store/encode_parts.h"

namespace kanuka::store {

namespace {

using grid::LayerOp;
using grid::LobeId;

class EmitterEncoder {
  public:
    EmitterEncoder(const ShadedGrid& shaded, GridInputs& inputs, const color::Palette& palette,
                   const UnitNormals& normals, Encoded& out)
        : m_shaded(shaded), m_grid(*shaded.grid), m_program(inputs.program()), m_inputs(inputs),
          m_palette(palette), m_normals(normals), m_out(out) {}

    void run() {
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

  private:
    // How much of what lies below a subtree covers, as bsdf::Material has it.
    float coverage(int node, int i) {
        const grid::LayerNode& n = m_program.nodes[size_t(node)];
        const float w = n.weight < 0 ? 1 : m_inputs.value(n.weight, 0, i);
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
            return m_inputs.value(slot, c, v, color::LargestRadiance);
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
            return light * (given ? m_inputs.value(n.inputs[size_t(k)], 0, i)
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
        return dot(cross_product,
                   m_normals.of(vertex[0]) + m_normals.of(vertex[1]) + m_normals.of(vertex[2])) < 0;
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
            const float presence = m_program.presence < 0 ? 1 : m_inputs.value(m_program.presence, 0, i);
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

    // One a segment, which is met and never asked for: nobody can choose a place on it. Its area is the round
    // one.
    void encode_shining_fibre() {
        for (const uint32_t i : m_out.indices) {
            const uint32_t last = end_of_segment(m_out.shape, i);
            const float *p = m_out.positions.data() + size_t(i) * 4,
                        *q = m_out.positions.data() + size_t(last) * 4;
            const Vec3f begin(p[0], p[1], p[2]), end(q[0], q[1], q[2]);
            const int vertex[] = {int(i), int(last)};
            add_emitter({begin, end, begin}, vertex);
            Emitter& e = m_out.emitters.back();
            e.area = last == i ? 4 * Pi * p[3] * p[3] : Pi * (p[3] + q[3]) * length(end - begin);
            e.power = 0;
        }
    }

    const ShadedGrid& m_shaded;
    const grid::Grid& m_grid;
    const grid::LayeringProgram& m_program;
    GridInputs& m_inputs;
    const color::Palette& m_palette;
    const UnitNormals& m_normals;
    Encoded& m_out;
    float m_shape[2] = {0, 0}, m_shape_light = 0; // sums over an emitter's vertices and lobes
};

} // namespace

void encode_emitters(const ShadedGrid& shaded, GridInputs& inputs, const color::Palette& palette,
                     const UnitNormals& normals, Encoded& out) {
    EmitterEncoder(shaded, inputs, palette, normals, out).run();
}

} // namespace kanuka::store
