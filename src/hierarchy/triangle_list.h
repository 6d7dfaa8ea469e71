// Few triangles need no tree: they are a list, and rays in W lanes test all of it together.
//
//     W rays ──► all vertices, as those rays see them ──► all triangles ──► the closest hit of each lane
//
// A ray in a tree waits for one box before the next, and tests leaves whose triangles are mostly elsewhere.
// Here nothing waits, and nothing is chosen.
//
// Few triangles are large ones, such as walls: vertices are floats as they were given, on no lattice.
// Distances of trees are means of the corners', and off by rounding of the triangle's size; those of walls
// that stand along axes are here what they are divided by the ray's slope, and off by rounding of themselves.
#pragma once

#include <span>
#include <type_traits>
#include <vector>

#include "hierarchy/candidate.h"
#include "hierarchy/leaf_lanes.h"

namespace kanuka::hierarchy {

class TriangleList {
  public:
    static constexpr size_t Most = 128; // triangles
    struct alignas(16) Vertex {
        float at[4]; // fourth: nothing
    };
    struct Triangle {
        uint32_t vertex[3];
        int8_t across; // the axis along which all corners have one coordinate; -1: there is none
    };

    // There are at most `Most`. Vertices that are the same are kept once.
    void add(const Vec3f (&corners)[3]);
    std::span<const Vertex> vertices() const { return m_vertices; }
    std::span<const Triangle> triangles() const { return m_triangles; } // in the order in which they came

  private:
    std::vector<Vertex> m_vertices;
    std::vector<Triangle> m_triangles;
};

// Rays as Ray has them. Lanes without one have a t_max below zero.
template <int W>
struct RayLanes {
    Vec3<Float<W>> o, d;
    Float<W> t_min, t_max;
};
template <int W>
struct ListHits {
    Float<W> t, u, v; // t: where nothing is hit, t_max
    Int<W> triangle;  // of the list; -1 = nothing is hit
};
// Everything is there for all rays.
struct AcceptsAll {};

template <int W, Query Asked, class Accepts>
class ListTracer {
  public:
    // accepts(lanes, triangle, depths): which of these lanes, as bits.
    ListTracer(const TriangleList& list, const RayLanes<W>& rays, Accepts& accepts)
        : m_list(list), m_accepts(accepts), m_rays(rays), m_order(rays.d), m_o(m_order.turned(rays.o)) {
        const Vec3<Float<W>> d = m_order.turned(rays.d);
        m_minus_slope[0] = -d.x / d.z, m_minus_slope[1] = -d.y / d.z;
        m_range = {Float<W>(1.0f) / d.z, rays.t_min,
                   select(are_traceable(rays, d.z), rays.t_max, Float<W>(-1.0f))};
        m_hits = {rays.t_max, Float<W>(0.0f), Float<W>(0.0f), Int<W>(-1)};
    }
    ListHits<W> run() {
        if ((m_range.t_max >= m_range.t_min).bits() != 0) {
            SeenVertex seen[3 * TriangleList::Most];
            see_vertices(seen);
            meet_triangles(seen);
        }
        return m_hits;
    }

  private:
    // The axis along which a ray runs most comes last, behind the two that follow it, as in TracedRay; lane
    // by lane.
    class Order {
      public:
        explicit Order(const Vec3<Float<W>>& d) {
            const Float<W> x = abs(d.x), y = abs(d.y), z = abs(d.z);
            m_is_x = (x >= y) & (x >= z), m_is_y = (!m_is_x) & (y >= z);
            m_axis[2] = select(m_is_x, Int<W>(0), select(m_is_y, Int<W>(1), Int<W>(2)));
            m_axis[0] = select(m_is_x, Int<W>(1), select(m_is_y, Int<W>(2), Int<W>(0)));
            m_axis[1] = select(m_is_x, Int<W>(2), select(m_is_y, Int<W>(0), Int<W>(1)));
        }
        Vec3<Float<W>> turned(const Vec3<Float<W>>& v) const {
            return {pick(v.y, v.z, v.x), pick(v.z, v.x, v.y), pick(v.x, v.y, v.z)};
        }
        // Of a vertex that is the same for all lanes.
        Float<W> coordinate(int k, const TriangleList::Vertex& vertex) const {
#ifdef __AVX512F__
            if constexpr (W == 16)
                return Float<W>((typename Float<W>::F)_mm512_permutevar_ps(
                    _mm512_broadcast_f32x4(_mm_load_ps(vertex.at)), (__m512i)m_axis[k].v));
#endif
            if constexpr (W % 8 == 0) {
                Float<W> all;
                const __m256 both = _mm256_broadcast_ps(reinterpret_cast<const __m128*>(vertex.at));
                for (int half = 0; half < W / 8; half++)
                    reinterpret_cast<__m256*>(&all.v)[half] =
                        _mm256_permutevar_ps(both, reinterpret_cast<const __m256i*>(&m_axis[k].v)[half]);
                return all;
            } else {
                return gather(vertex.at, m_axis[k]);
            }
        }

      private:
        Float<W> pick(Float<W> of_x, Float<W> of_y, Float<W> of_z) const {
            return select(m_is_x, of_x, select(m_is_y, of_y, of_z));
        }
        Mask<W> m_is_x, m_is_y;
        Int<W> m_axis[3];
    };
    struct SeenVertex {
        Float<W> x, y, z;
    };

    // Of a triangle, as the rays see it.
    struct Edges {
        Seen<W> corner[3];
        Float<W> z[3], weight[3];

        Edges(const SeenVertex* seen, const TriangleList::Triangle& triangle) {
            for (int c = 0; c < 3;
                 c++) { // number by number: structs are copied in pieces, and read as a whole
                const SeenVertex& vertex = seen[triangle.vertex[c]];
                corner[c].x = vertex.x, corner[c].y = vertex.y, z[c] = vertex.z;
            }
            for (int c = 0; c < 3; c++)
                weight[c] = edge(corner[c == 2 ? 0 : c + 1], corner[c == 0 ? 2 : c - 1]);
        }
        uint32_t inside() const { return through(weight[0], weight[1], weight[2]); }
    };

    // `z`: of directions, along the axis that they run along most. As TracedRay has it.
    static Mask<W> are_traceable(const RayLanes<W>& rays, Float<W> z) {
        const Float<W> limit(LargestCoordinate);
        const auto are_below = [&](const Vec3<Float<W>>& v) {
            return (abs(v.x) < limit) & (abs(v.y) < limit) & (abs(v.z) < limit);
        };
        return are_below(rays.o) & are_below(rays.d) & (abs(z) > Float<W>(1 / LargestCoordinate)) &
               (rays.t_min >= Float<W>(0.0f));
    }

    void see_vertices(SeenVertex* seen) const {
        for (const TriangleList::Vertex& vertex : m_list.vertices()) {
            seen->z = m_order.coordinate(2, vertex) - m_o.z;
            seen->x = fma(seen->z, m_minus_slope[0], m_order.coordinate(0, vertex) - m_o.x);
            seen->y = fma(seen->z, m_minus_slope[1], m_order.coordinate(1, vertex) - m_o.y);
            seen++;
        }
    }

    // In two loops, whose branches are foreseen: which triangles some ray passes through, and at what
    // distance.
    void meet_triangles(const SeenVertex* seen) {
        const std::span<const TriangleList::Triangle> triangles = m_list.triangles();
        uint32_t active = (m_range.t_max >= m_range.t_min).bits();
        uint32_t passed[TriangleList::Most];
        size_t count = 0;
        for (uint32_t k = 0; k < triangles.size(); k++) {
            passed[count] = k;
            count += (Edges(seen, triangles[k]).inside() & active) != 0;
        }
        for (size_t i = 0; i < count && active != 0; i++) {
            const uint32_t k = passed[i];
            const Edges edges(seen, triangles[k]);
            const Depths<W> depths(m_range, edges.inside() & active, edges.corner, edges.weight, edges.z,
                                   [&](Float<W> depth, Float<W> sum) {
                                       return triangles[k].across >= 0 ? distance_across(triangles[k])
                                                                       : depth * m_range.per_z / sum;
                                   });
            // Of hits at one distance that of the lowest number counts, which came first.
            Mask<W> hit =
                mask_of_bits(depths.hit) & ((depths.t < m_range.t_max) | (m_hits.triangle < Int<W>(0)));
            if constexpr (!std::is_same_v<Accepts, AcceptsAll>)
                hit = mask_of_bits(m_accepts(hit.bits(), k, depths));
            m_hits.triangle = select(hit, Int<W>(int(k)), m_hits.triangle);
            m_hits.t = select(hit, depths.t, m_hits.t);
            m_hits.u = select(hit, depths.u, m_hits.u), m_hits.v = select(hit, depths.v, m_hits.v);
            if constexpr (Asked == Query::Any)
                active &= ~hit.bits();
            else
                m_range.t_max = select(hit, depths.t, m_range.t_max);
        }
    }
    Float<W> distance_across(const TriangleList::Triangle& wall) const {
        const int axis = wall.across;
        return (Float<W>(m_list.vertices()[wall.vertex[0]].at[axis]) - m_rays.o[axis]) / m_rays.d[axis];
    }
    static Mask<W> mask_of_bits(uint32_t bits) {
        return ((Int<W>(int(bits)) >> Int<W>::lane_index()) & Int<W>(1)) != Int<W>(0);
    }

    const TriangleList& m_list;
    Accepts& m_accepts;
    const RayLanes<W>& m_rays;
    const Order m_order;
    const Vec3<Float<W>> m_o; // as m_order has it
    Float<W> m_minus_slope[2];
    DepthRange<W> m_range; // up to the closest hit so far
    ListHits<W> m_hits;
};

// By AVX-512, where everything is there: for machines that have it alone.
ListHits<16> list_hits_16(const TriangleList& list, const RayLanes<16>& rays, Query asked);

} // namespace kanuka::hierarchy
