// The grids and meshes of a primitive, as one mesh.
#pragma once

#include <array>
#include <map>
#include <unordered_map>
#include <vector>

#include "geom/decimate.h"
#include "render/albedo.h"
#include "store/store.h"

namespace kanuka::render {

// Vertices at the same place are one. Where a grid's colours vary it has a vertex for each that was shaded,
// not only for those that are traced; these lie on the traced triangles, so the surface is the same. On an
// edge that two grids share both have as many as the coarser of them: no crack, and no vertex in the middle
// of another's edge.
class Weld {
  public:
    Weld(const store::Store& store, const Albedos& albedos) : m_store(store), m_albedos(albedos) {}
    // Shapes that are no fibres.
    geom::ColoredMesh run(int first, int count);
    size_t nowhere() const { return m_nowhere; } // faces with a corner that is no number, which were left out

  private:
    struct Part { // of a shape
        int shape;
        bool fine, outward;
        std::vector<uint32_t> traced; // vertices of the mesh, by those that are traced
    };
    // Of a polyline that grids share, from one of its traced vertices to the next.
    struct Segment {
        int pieces;
        uint32_t first = 0; // of the vertices between, from the end with the lower number on
    };
    struct Side {
        int cells, step, spacing;     // shading cells; a traced cell; between vertices of the polyline
        int traced, stride, offset;   // traced cells; from a traced vertex to the next, and of the first
        int shaded_stride, shaded_at; // likewise of shading vertices
        bool high;                    // VMax or UMax
    };

    void look_at(int shape);
    bool winds_outward(const Part& part) const;
    static Side side_of(const store::ShapeRecord& s, int edge);
    void note_edges(const Part& part);
    void note_segments(const Part& part, const Side& side);
    void fill_segments();
    void add(const Part& part);
    void add_mesh(const Part& part);
    void add_fine_grid(const Part& part);
    std::vector<uint32_t> fine_vertices(const Part& part);
    void put_side(const Part& part, const Side& side, std::vector<uint32_t>& vertices);
    Vec3f on_traced(const Part& part, int i, int j) const;

    uint32_t vertex_at(const Vec3f& p);
    uint32_t new_vertex(const Vec3f& p);
    void color(uint32_t vertex, const Rgb& rgb);
    void face(const Part& part, uint32_t a, uint32_t b, uint32_t c);
    Vec3f position(const store::ShapeRecord& s, int vertex) const {
        const float* p = m_store.floats(s) + s.positions + 3 * vertex;
        return {p[0], p[1], p[2]};
    }
    void drop_folded_lines();
    geom::ColoredMesh finish();

    struct HashOfPlace {
        size_t operator()(const std::array<uint32_t, 3>& p) const {
            uint64_t h = p[0];
            for (const uint32_t word : {p[1], p[2]})
                h = (h ^ (h >> 29)) * 0x9e3779b97f4a7c15u + word;
            return size_t(h ^ (h >> 32));
        }
    };
    const store::Store& m_store;
    const Albedos& m_albedos;
    std::vector<Part> m_parts;
    std::unordered_map<std::array<uint32_t, 3>, uint32_t, HashOfPlace>
        m_vertices; // by the bits of their place
    std::map<std::array<uint32_t, 2>, Segment> m_segments;
    size_t m_nowhere = 0;
    geom::ColoredMesh m_mesh;       // colours are sums
    std::vector<uint32_t> m_colors; // how many there are in each
};

} // namespace kanuka::render
