#include "store/page_check.h"

#include <cstring>
#define XXH_INLINE_ALL // no library is needed where this runs
#include <xxhash.h>

namespace kanuka::store {

namespace {

constexpr size_t HeaderWords = sizeof(PageHeader) / 4;

// Of words of a page, in 64 bits: sums of damaged counts do not wrap.
struct Part {
    uint64_t begin, end;
    bool holds(int64_t at, uint64_t count) const {
        return at >= 0 && uint64_t(at) >= begin && uint64_t(at) + count <= end;
    }
};

const char* fault_of_header(const PageHeader& h, size_t words) {
    if (h.magic != PageMagic)
        return "its header is missing";
    if (h.version != PageVersion)
        return "it is of another version";
    if (h.words != words)
        return "its size differs from what its header says";
    const uint64_t order[] = {HeaderWords,    h.shapes_at,  h.tables_at,   h.inputs_at,
                              h.positions_at, h.indices_at, h.emitters_at, h.words};
    for (int i = 0; i + 1 < 8; i++)
        if (order[i] > order[i + 1])
            return "its sections overlap";
    if (h.shapes_at + uint64_t(h.shapes) * ShapeWords > h.tables_at ||
        h.emitters_at + uint64_t(h.emitters) * (sizeof(Emitter) / 4) > h.words ||
        (h.inputs_at - h.tables_at) % 2 != 0)
        return "its counts do not fit";
    return nullptr;
}

// Lattices have at most 2^15 cells a side, meshes any number of vertices.
constexpr int32_t MostAcross = 1 << 20;

class ShapeCheck {
  public:
    ShapeCheck(const Page& page, const ShapeRecord& s) : m_page(page), m_h(page.header()), m_s(s) {}

    bool geometry_fits() const {
        const ShapeRecord& s = m_s;
        if (s.mu < 0 || s.mv < 0 || s.nu < 0 || s.nv < 0 || s.motion_segments < 0 || s.motion_stride < 0)
            return false;
        const bool mesh = s.flags & ShapeRecord::Mesh, fibre = s.flags & ShapeRecord::Fibre;
        if (!mesh && (s.mu > MostAcross || s.mv > MostAcross || s.mu < 1 || s.mv < 1))
            return false;
        if (s.nu > MostAcross * 1024 || s.nv > MostAcross)
            return false;
        const uint64_t traced = mesh ? uint64_t(s.mu) : uint64_t(s.mu + 1) * uint64_t(s.mv + 1);
        if (mesh && traced != shading_vertices())
            return false;
        if (!mesh && (uint64_t(s.mu) << (s.steps & 15)) > uint64_t(s.nu) && rounded())
            return false;
        const uint64_t words =
            traced * (fibre ? 4 : 3) + uint64_t(s.motion_segments) * uint64_t(s.motion_stride);
        return Part{m_h.positions_at, m_h.indices_at}.holds(s.positions, words) && (!mesh || indices_fit());
    }

    bool emitters_fit() const {
        const uint64_t emitters = m_s.emitter < 0 ? 0 : uint64_t(m_s.emitter) + count_of_triangles();
        return emitters <= m_h.emitters;
    }

    // `entries`: of the program's words, its normal and, if it has one, its tangent; of words of variants.
    bool inputs_fit(int entries) const {
        if (!Part{m_h.tables_at, m_h.inputs_at}.holds(m_s.slot_table, 2 * uint64_t(entries)))
            return false;
        for (int e = 0; e < entries; e++) {
            const uint32_t* entry = m_page.words.data() + m_s.slot_table + 2 * e;
            if (entry[1] > 1)
                return false;
            // Normals of all steps follow each other. Constants are read as rows of four, to the next
            // section.
            const uint64_t steps = uint64_t(m_s.motion_segments) + 1;
            const uint64_t words = entry[1] == 1 ? shading_vertices() * steps : 1;
            if (entry[0] < m_h.inputs_at || entry[0] + words > m_h.positions_at)
                return false;
        }
        return true;
    }

  private:
    bool rounded() const { return m_s.flags & ShapeRecord::Rounded; }
    uint64_t shading_vertices() const { return uint64_t(m_s.nu + 1) * uint64_t(m_s.nv + 1); }
    uint64_t count_of_triangles() const {
        const bool mesh = m_s.flags & ShapeRecord::Mesh, quads = m_s.flags & ShapeRecord::Quads;
        return mesh ? uint64_t(m_s.mv) * (quads ? 2 : 1) : uint64_t(m_s.mu) * uint64_t(m_s.mv) * 2;
    }
    bool indices_fit() const {
        const bool quads = m_s.flags & ShapeRecord::Quads, fibre = m_s.flags & ShapeRecord::Fibre;
        const uint64_t each = fibre ? 1 : quads ? 4 : 3, count = uint64_t(m_s.mv) * each;
        if (m_s.mv == 0)
            return true;
        if (!Part{m_h.indices_at, m_h.emitters_at}.holds(m_s.indices, count))
            return false;
        // A fibre's segment ends at the vertex after. Balls are the vertices, for whoever has no index of
        // them.
        const bool balls = m_s.flags & ShapeRecord::Balls;
        const uint64_t end = uint64_t(m_s.mu) - (fibre && !balls && m_s.mu > 0 ? 1 : 0);
        const uint32_t* index = m_page.words.data() + m_s.indices;
        if (balls && (!fibre || m_s.mv != m_s.mu))
            return false;
        return std::all_of(index, index + count, [&](uint32_t i) { return i < end; });
    }

    const Page& m_page;
    const PageHeader& m_h;
    const ShapeRecord& m_s;
};

} // namespace

uint64_t checksum_of(PageHeader header, const Page& page) {
    header.checksum = 0;
    const uint64_t seed = XXH3_64bits(&header, sizeof header);
    return XXH3_64bits_withSeed(page.words.data() + HeaderWords, (page.words.size() - HeaderWords) * 4, seed);
}

const char* fault_of(const Page& page) {
    if (page.words.size() < HeaderWords)
        return "its header is missing";
    if (const char* fault = fault_of_header(page.header(), page.words.size()))
        return fault;
    return checksum_of(page.header(), page) == page.header().checksum ? nullptr
                                                                      : "its checksum does not match";
}

const char* fault_of(const Page& page, const grid::LayeringProgram& program) {
    if (const char* fault = fault_of(page))
        return fault;
    const int words = int(grid::WordLayout(program).words.size());
    const int entries = words * program.variants + (program.needs_tangent() ? 2 : 1);
    const PageHeader& h = page.header();
    for (uint32_t i = 0; i < h.shapes; i++) {
        ShapeRecord s;
        std::memcpy(&s, page.words.data() + h.shapes_at + i * ShapeWords, sizeof s);
        const ShapeCheck check(page, s);
        if (!check.geometry_fits() || !check.emitters_fit() || !check.inputs_fit(entries))
            return "its shapes do not fit";
    }
    return nullptr;
}

} // namespace kanuka::store
