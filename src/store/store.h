// The micropolygon store: grids with their lobe inputs, as pages. A page is what one primitive became; it is
// one block of 32-bit words with relative offsets, the same in memory and on disk. Resident pages lie in
// windows of 8 GiB, so that within one a vertex is named by a 32-bit word index and gathered by lanes.
//
//   page:  header │ shape records │ slot tables │ lobe-input words │ positions │ indices │ emitters
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/large_pages.h"
#include "color/palette.h"
#include "grid/grid.h"
#include "grid/layering.h"
#include "grid/word_layout.h"

namespace kanuka::store {

inline constexpr uint32_t PageMagic = 0x53504d4b; // "KMPS"
inline constexpr uint32_t PageVersion = 5;

// One traced shape: a grid, or a mesh. Sixteen words; offsets are relative to the page in a page, to the
// window of its program when resident (Store::words). Hot: read for every hit.
struct ShapeRecord {
    enum Flags : int32_t {
        Mesh = 1,
        Quads = 2,
        HasNormals = 4,
        Flips = 8,
        Collapsed = 16,
        FlatNormal = 32,
        ShinesBoth = 64, // to the inside too; what is sent there is met, not asked for
        Fibre = 128,     // a mesh of round segments: an index each, positions are xyz and the radius
        Layer = 256,     // rays that come from the inside do not meet it
        Rounded = 512,   // its facets stand for a curved surface, which its normals tell of
        Tinted = 1024,   // not all colours are stopped alike: LayeringProgram::opacity
        OfGrids = 2048,  // a mesh that is cut out of grids: its vertices are theirs
        Balls = 4096     // a fibre whose segments end where they begin: the i-th is vertex i
    };
    int32_t flags;
    int32_t program;    // index into Store::programs
    int32_t slot_table; // words: {base, stride} for each word of the vertex record, then for the normal,
                        // then for the tangent of programs that need one; then words of its variants
    int32_t positions; // of traced vertex 0: xyz triples; of grids a multiple of 3, for the ray tracer's sake
    int32_t mu, mv;    // traced cells; mesh: vertices, faces
    int32_t steps;     // log2: step_u | step_v << 4 | edge steps << 8, 12, 16, 20 (Edge order)
    int32_t nu, nv;    // shading cells
    int32_t indices;   // mesh: vertices_per_face words a face
    int32_t emitter;   // first of its triangles among the emitters (two a cell or quad); -1 = does not emit
    int32_t object_id; // like all indices into the store's tables, given when a page is made resident
    int32_t interior;  // index into Store::interiors; -1 = none
    int32_t links;     // index into Store::links
    // A shape that changes while the shutter is open: its positions (and normals) follow for every further
    // step, steps evenly apart. 0 segments = still.
    int32_t motion_segments;
    int32_t motion_stride; // words from a position to where it is a step later
};
static_assert(sizeof(ShapeRecord) == 64);
// The vertex that a segment of a fibre ends at.
inline uint32_t end_of_segment(const ShapeRecord& s, uint32_t first) {
    return s.flags & ShapeRecord::Balls ? first : first + 1;
}
inline constexpr int ShapeWords = sizeof(ShapeRecord) / 4;

// Triangles of a shape that emits: two a cell or quad.
inline int emitter_count(const ShapeRecord& s) {
    const bool mesh = s.flags & ShapeRecord::Mesh, quads = s.flags & ShapeRecord::Quads;
    return mesh ? s.mv * (quads ? 2 : 1) : s.mu * s.mv * 2;
}

// One emitting triangle, in the space of its group. Radiance is constant over it: what next-event estimation
// samples and what a path finds are the same by construction.
struct Emitter {
    Vec3f p0, e1, e2;
    float c0, c1, c2, scale; // radiance as color::Palette::emission has it: scale * S(lambda; c) * white
    float power;             // area * luminance of scale * rgb
    float area;
    // 1: emits on the side of -cross(e1, e2); above: see EmissionShape.
    uint32_t flags;
    static constexpr float ConeUnit = 65535;
};
static_assert(sizeof(Emitter) == 64);

// How an emitter's radiance falls with the cosine to its normal: from cos_inner down to nothing at cos_outer
// (a cubic, as spots have), or with a power. In Emitter::flags: 16 bits for cos_outer; a bit that says
// which; 14 bits for cos_inner's place between cos_outer and 1, or for the exponent's logarithm.
struct EmissionShape {
    float cos_outer = 0, cos_inner = 0, exponent = 0;
    static constexpr int ConeShift = 1, MoreShift = 18;
    static constexpr uint32_t Power = 1u << 17, MoreMask = 0x3fff;
    static constexpr float ExponentRange = 10; // log2(1 + exponent) is below

    uint32_t bits() const;
    float sent() const;                     // radiant exitance over that of a diffuse emitter
    static float reach_of(uint32_t flags) { // a cosine below which nothing goes
        return std::max(float((flags >> ConeShift) & 0xffffu) / Emitter::ConeUnit - 1e-5f, 0.0f);
    }
};

// How thick an interior is here and there: values on a lattice over a box, or over the body of a shape within
// it; none outside.
struct DensityField {
    enum Shape : int32_t {
        Box,
        Ellipsoid,
        Cylinder,
        Cone
    }; // the last two along z, the cone's tip at its end
    Shape shape = Box;
    std::array<int, 3> size{1, 1, 1};         // of the lattice; x runs fastest
    std::array<float, 12> unit_from_render{}; // the box is [0, 1]^3 there
    std::vector<float> density;               // factors from 0 to 1 of the interior's amounts
};

struct Interior {
    float ior = 1.5f, priority = 0;
    std::array<float, 4> absorption_spectrum{}; // uplift of sigma_a / scale: c0 c1 c2 scale, 1/m
    std::array<float, 4> scattering_spectrum{}; // likewise
    bool absorbs = false, scatters = false;
    grid::LobeId phase = grid::LobeId::HenyeyGreensteinPfrgb;
    std::array<float, grid::Interior::MaxPhaseInputs> phase_inputs{};
    std::shared_ptr<const DensityField> field; // null = the same everywhere
    bool operator==(const Interior&) const = default;
};

// Which lights shine on what, and which rays see it, of a page's shapes.
struct Links {
    int32_t lit_sets = 1;     // light linking: the bit of the receivers' set that it is in,
    int32_t shone_sets = -1;  // bits of the sets that it shines on, if it emits,
    int32_t lets_through = 0; // and of the lights whose shadow rays pass through it (shadow linking)
    enum Seen : int32_t {
        OneSided = 1, // rays that come from the inside do not meet it
        HeldOut = 2,  // to camera rays a hole in the picture
        Unseen = 4,   // by camera rays
        Backdrop = 8  // it shines for the camera and in mirrors, and lights nothing
    };
    int32_t seen = 0;
    // A level of detail in transition is there for paths whose number (RayPacket::level) lies between.
    float level_from = 0, level_to = 1;
    bool fades() const { return level_from > 0 || level_to < 1; }
    // Which of the declared area lights it is, from 1 on; 0 = none, and what it shines with is its own.
    int32_t area_light = 0;
    bool operator==(const Links&) const = default;
};

struct PageHeader {
    uint32_t magic, version;
    uint64_t key[2]; // StoredPage::content on disk; else zero
    uint32_t words;  // of the whole page
    uint32_t shapes, shapes_at;
    uint32_t tables_at, inputs_at, positions_at, indices_at, emitters_at, emitters;
    uint32_t grid_bytes, input_bytes; // for the statistics
    uint32_t vertices, micropolygons, traced_polygons;
    uint64_t checksum; // on disk: checksum_of(); else zero
};

static_assert(sizeof(PageHeader) == 88); // no padding: it is hashed and written as it is

class Page {
  public:
    std::vector<uint32_t> words; // header first
    PageHeader& header() { return *reinterpret_cast<PageHeader*>(words.data()); }
    const PageHeader& header() const { return *reinterpret_cast<const PageHeader*>(words.data()); }
};

// What shading made of one grid, to be encoded.
struct ShadedGrid {
    const grid::Grid* grid;
    const grid::TracedGrid* traced; // or
    const grid::TracedMesh* mesh = nullptr;
    const grid::VertexInputs* inputs;
    bool smooth = false; // normals are those of the surface, not of bumps: facets may be Rounded
};

// Encodes the grids of a primitive: folds inputs that are constant over a grid, quantises the others.
// Parallel over grids; the same page for any thread count. Inputs outside their range, NaN and infinite ones
// are clamped, replaced, and counted in `bad_inputs`. `palette`: what RGB means; null = Rec.709.
// `lost`: adds up how many finite values were beyond what is kept, and were made smaller.
Page encode(std::span<const ShadedGrid> grids, const grid::LayeringProgram& program, uint64_t& bad_inputs,
            const color::Palette* palette = nullptr, uint64_t* lost = nullptr);
// Multiplies what the page's emitters give, by a factor that may depend on their whole area.
float emitting_area(const Page& page);
void scale_emission(Page& page, float factor);

// Where the page's own space has its origin in the space that it is placed in: positions and emitters are
// moved there, each sum rounded once, from double precision.
void translate(Page& page, const std::array<double, 3>& by);

// One more than the largest number of a measured spectrum, in the palette, that it names; 0 = it names none.
uint32_t spectra_named(const Page& page);

// Resident pages. Shapes name words by 32-bit offsets into a window of address space; pages that do not fit
// into one lie in the next. All shapes of a program lie in one window, and a program with shapes in several
// is there once for each: lanes that hit one program share a base address, and gather from it by 32-bit
// indices.
class Store {
  public:
    // The reach of a signed 32-bit index.
    static constexpr size_t LargestWindow = size_t(1) << 31;

    explicit Store(size_t window_words = LargestWindow); // less: for tests of what happens at the border
    ~Store();
    Store(const Store&) = delete;

    int add_interior(const Interior& interior);
    int add_links(const Links& links);
    // Makes a page resident; returns the index of its first shape. Not thread safe: the order of calls is the
    // order of shapes, and must not depend on threads.
    int add_page(const Page& page, const grid::LayeringProgram& program, int interior,
                 const Links& links = {}, int object_id = 0);

    const std::vector<grid::LayeringProgram>& programs() const { return m_programs; }
    // Word 0 of the window that the shapes of a program lie in, and its number.
    const uint32_t* words(int program) const { return m_windows[size_t(window(program))].words; }
    const uint32_t* words(const ShapeRecord& shape) const { return words(shape.program); }
    const float* floats(int program) const { return reinterpret_cast<const float*>(words(program)); }
    const float* floats(const ShapeRecord& shape) const { return floats(shape.program); }
    int window(int program) const { return m_window_of_program[size_t(program)]; }
    const std::vector<Interior>& interiors() const { return m_interiors; }
    const std::vector<Links>& links() const { return m_links; } // 0 = the default
    const Links& links_of(int shape) const { return m_links[size_t(m_shapes[size_t(shape)].links)]; }
    const std::vector<ShapeRecord>& shapes() const { return m_shapes; }
    // Gives the traced vertices of a shape, no fibre, new places at all times: to(place). Emitters go along
    // and keep their power. Thread safety: for different shapes at the same time.
    void move_vertices(int shape, const std::function<Vec3f(const Vec3f&)>& to);
    // Those of a fibre with their radii: move(place and radius). What it emits stays where it was,
    // since no place on it is ever chosen.
    void move_fibre(int shape, const std::function<void(float*)>& move);
    const LargeVector<Emitter>& emitters() const { return m_emitters; }
    uint64_t grid_bytes() const { return m_grid_bytes; }
    uint64_t input_bytes() const { return m_input_bytes; }

    // Presence at (u, v) of a shape, decoded alone: for the ray tracer's hit filter.
    float presence(int shape, int prim, float u, float v) const;
    // Oi there, of what is Tinted.
    Rgb opacity(int shape, int prim, float u, float v) const;

  private:
    struct Window {
        uint32_t* words;
        size_t used;
        bool paged; // its pages come and go: base/paged_memory.h
    };
    void open_window(bool paged = true);
    bool has_room(size_t words);                            // in the last window, once it has it
    int program_here(const grid::LayeringProgram& program); // in the last window
    uint32_t* place_of(const Page& page);                   // in the last window, or a new one
    float number(grid::WordLayout::Place place, int shape, int prim, float u, float v) const;
    size_t m_window_words;
    std::vector<Window> m_windows;
    std::vector<grid::LayeringProgram> m_programs;
    std::vector<std::string> m_program_keys;
    std::vector<int> m_window_of_program;
    std::vector<grid::WordLayout::Place> m_presence; // of each program; word -1 = always present
    std::vector<std::array<grid::WordLayout::Place, 3>> m_opacity; // likewise
    std::vector<Interior> m_interiors;
    std::vector<Links> m_links{Links()};
    std::vector<ShapeRecord> m_shapes;
    LargeVector<Emitter> m_emitters;
    uint64_t m_grid_bytes = 0, m_input_bytes = 0;
};

} // namespace kanuka::store
