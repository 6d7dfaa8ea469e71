#include "store/store.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <sys/mman.h>

#include "store/quantize.h"

namespace kanuka::store {

namespace {
constexpr size_t PageAlignment = 48; // words: whole cache lines, and whole xyz triples
constexpr size_t Slack = 64;         // bytes: lanes load whole rows
// Tables of 16 words that lanes index by 32 bits: shapes and emitters.
constexpr size_t MostRows = (size_t(1) << 31) / 16;
static_assert(sizeof(ShapeRecord) == 64 && sizeof(Emitter) == 64);
} // namespace

uint32_t EmissionShape::bits() const {
    const uint32_t outer = uint32_t(cos_outer * Emitter::ConeUnit) << ConeShift;
    const auto more = [](float x) { return uint32_t(std::clamp(x, 0.0f, 1.0f) * float(MoreMask) + 0.5f); };
    if (exponent > 0)
        return outer | Power | more(std::log2(1 + exponent) / ExponentRange) << MoreShift;
    return outer | more((cos_inner - cos_outer) / std::max(1 - cos_outer, 1e-6f)) << MoreShift;
}

// Integrals of the cosine times falloff, by the cosine; over 1/2.
float EmissionShape::sent() const {
    const float a = cos_outer, d = std::max(cos_inner - a, 0.0f);
    if (exponent > 0)
        return 2 * (1 - std::pow(a, exponent + 2)) / (exponent + 2);
    return 1 - cos_inner * cos_inner + d * (a + 0.7f * d);
}

Store::Store(size_t window_words) : m_window_words(window_words) {
    open_window();
}

Store::~Store() {
    for (const Window& w : m_windows)
        if (!w.paged || !paged_memory::release(w.words))
            munmap(w.words, m_window_words * 4 + Slack);
}

// Reserved, not committed: memory comes as pages are added.
void Store::open_window(bool paged) {
    const size_t bytes = m_window_words * 4 + Slack;
    if (void* p = paged ? paged_memory::reserve(bytes) : nullptr) {
        m_windows.push_back({static_cast<uint32_t*>(p), 0, true});
        return;
    }
    void* p =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (p == MAP_FAILED)
        throw Error("cannot reserve address space for the micropolygon store; check ulimit -v",
                    ExitCode::Internal);
    want_large_pages(p, bytes);
    m_windows.push_back({static_cast<uint32_t*>(p), 0, false});
}

int Store::program_here(const grid::LayeringProgram& program) {
    const std::string key = program.key();
    const int here = int(m_windows.size()) - 1;
    for (size_t i = 0; i < m_program_keys.size(); i++)
        if (m_window_of_program[i] == here && m_program_keys[i] == key)
            return int(i);
    m_programs.push_back(program);
    m_program_keys.push_back(key);
    m_window_of_program.push_back(here);
    m_presence.push_back(program.presence < 0 ? grid::WordLayout::Place{}
                                              : grid::WordLayout(program).places[size_t(program.presence)]);
    m_opacity.emplace_back();
    for (size_t c = 0; c < 3; c++)
        if (program.opacity[c] >= 0)
            m_opacity.back()[c] = grid::WordLayout(program).places[size_t(program.opacity[c])];
    return int(m_programs.size()) - 1;
}

int Store::add_interior(const Interior& interior) {
    for (size_t i = 0; i < m_interiors.size(); i++)
        if (m_interiors[i] == interior)
            return int(i);
    m_interiors.push_back(interior);
    return int(m_interiors.size()) - 1;
}

int Store::add_links(const Links& links) {
    for (size_t i = 0; i < m_links.size(); i++)
        if (m_links[i] == links)
            return int(i);
    m_links.push_back(links);
    return int(m_links.size()) - 1;
}

bool Store::has_room(size_t words) {
    const Window& last = m_windows.back();
    return !last.paged || paged_memory::make_room(last.words, words * 4 + Slack);
}

// Emitters live in their own table; the rest of the page moves in as it is.
uint32_t* Store::place_of(const Page& page) {
    const size_t words = page.header().emitters_at;
    const auto start = [&] {
        return (m_windows.back().used + PageAlignment - 1) / PageAlignment * PageAlignment;
    };
    if (words > m_window_words)
        throw Error("a page of " + std::to_string(words * 4 >> 20) + " MB is more than the " +
                    std::to_string(m_window_words * 4 >> 20) + " MB that one primitive may have");
    if (start() + words > m_window_words)
        open_window();
    if (!has_room(start() + words))
        open_window(false); // the disk is full: memory that stays has to do
    uint32_t* const at = m_windows.back().words + start();
    m_windows.back().used = start() + words;
    std::memcpy(at, page.words.data(), words * 4);
    return at;
}

int Store::add_page(const Page& page, const grid::LayeringProgram& made_of, int interior, const Links& links,
                    int object_id) {
    const PageHeader& h = page.header();
    if (m_shapes.size() + h.shapes > MostRows || m_emitters.size() + h.emitters > MostRows)
        throw Error("there are more than 2^27 grids, or more than 2^27 triangles that emit light: raise the "
                    "shading rate or the geometry tolerance");
    uint32_t* const at = place_of(page);
    const int program = program_here(made_of);
    const size_t base = size_t(at - m_windows.back().words);
    const int first = int(m_shapes.size());
    const int first_emitter = int(m_emitters.size()), links_index = add_links(links);
    const auto absolute = [&](int32_t offset) {
        return offset < 0 ? offset : int32_t(base + size_t(offset));
    };
    for (uint32_t i = 0; i < h.shapes; i++) {
        ShapeRecord s;
        std::memcpy(&s, page.words.data() + h.shapes_at + i * ShapeWords, sizeof s);
        s.program = program;
        s.interior = interior;
        s.links = links_index;
        s.object_id = object_id;
        s.slot_table = absolute(s.slot_table);
        s.positions = absolute(s.positions);
        s.indices = absolute(s.indices);
        s.emitter = s.emitter < 0 ? -1 : s.emitter + first_emitter;
        m_shapes.push_back(s);
    }
    for (uint32_t w = h.tables_at; w < h.inputs_at; w += 2)
        at[w] += uint32_t(base);
    m_emitters.resize(m_emitters.size() + h.emitters);
    if (h.emitters)
        std::memcpy(m_emitters.data() + first_emitter, page.words.data() + h.emitters_at,
                    h.emitters * sizeof(Emitter));
    m_grid_bytes += h.grid_bytes;
    m_input_bytes += h.input_bytes;
    return first;
}

void Store::move_vertices(int shape, const std::function<Vec3f(const Vec3f&)>& to) {
    const ShapeRecord& s = m_shapes[size_t(shape)];
    uint32_t* const words = m_windows[size_t(window(s.program))].words;
    float* const positions = reinterpret_cast<float*>(words) + s.positions;
    const bool mesh = s.flags & ShapeRecord::Mesh;
    const size_t vertices = mesh ? size_t(s.mu) : size_t(s.mu + 1) * size_t(s.mv + 1);
    const auto at = [&](size_t vertex) {
        const float* p = positions + 3 * vertex;
        return Vec3f(p[0], p[1], p[2]);
    };
    for (int step = 0; step <= s.motion_segments; step++) {
        float* p = positions + ptrdiff_t(step) * s.motion_stride;
        for (size_t v = 0; v < vertices; v++, p += 3) {
            const Vec3f moved = to({p[0], p[1], p[2]});
            p[0] = moved.x, p[1] = moved.y, p[2] = moved.z;
        }
    }
    if (s.emitter < 0)
        return;
    // Triangles as encode_emitters() has them.
    Emitter* e = m_emitters.data() + s.emitter;
    const auto move_emitter = [&](size_t a, size_t b, size_t c) {
        e->p0 = at(a), e->e1 = at(b) - e->p0, e->e2 = at(c) - e->p0;
        const float area = 0.5f * length(cross(e->e1, e->e2));
        if (std::isfinite(area) && area > 0 && e->area > 0) {
            e->scale *= e->area / area; // it keeps its power
            e->area = area;
        } else {
            e->area = e->power = 0;
        }
        e++;
    };
    if (!mesh) {
        const size_t row = size_t(s.mu) + 1;
        for (size_t j = 0; j < size_t(s.mv); j++)
            for (size_t k = j * row; k < j * row + size_t(s.mu); k++) {
                move_emitter(k, k + 1, k + row);
                move_emitter(k + row + 1, k + row, k + 1);
            }
        return;
    }
    const bool quads = s.flags & ShapeRecord::Quads;
    const uint32_t* corner = words + s.indices;
    for (int face = 0; face < s.mv; face++, corner += quads ? 4 : 3) {
        move_emitter(corner[0], corner[1], corner[quads ? 3 : 2]);
        if (quads)
            move_emitter(corner[2], corner[3], corner[1]);
    }
}

void Store::move_fibre(int shape, const std::function<void(float*)>& move) {
    const ShapeRecord& s = m_shapes[size_t(shape)];
    float* const vertices =
        reinterpret_cast<float*>(m_windows[size_t(window(s.program))].words) + s.positions;
    for (int step = 0; step <= s.motion_segments; step++)
        for (size_t v = 0; v < size_t(s.mu); v++)
            move(vertices + ptrdiff_t(step) * s.motion_stride + 4 * v);
}

float Store::presence(int shape, int prim, float u, float v) const {
    return number(m_presence[size_t(m_shapes[size_t(shape)].program)], shape, prim, u, v);
}

Rgb Store::opacity(int shape, int prim, float u, float v) const {
    const auto& places = m_opacity[size_t(m_shapes[size_t(shape)].program)];
    return {number(places[0], shape, prim, u, v), number(places[1], shape, prim, u, v),
            number(places[2], shape, prim, u, v)};
}

float Store::number(grid::WordLayout::Place place, int shape, int prim, float u, float v) const {
    const ShapeRecord& s = m_shapes[size_t(shape)];
    if (place.word < 0)
        return 1;
    const uint32_t* const words = this->words(s);
    const uint32_t base = words[s.slot_table + 2 * place.word],
                   stride = words[s.slot_table + 2 * place.word + 1];
    if (stride == 0)
        return floats(s)[base + uint32_t(place.half)];
    const auto at = [&](int vertex) {
        return from_half(uint16_t(words[base + uint32_t(vertex)] >> (16 * place.half)));
    };
    if (s.flags & ShapeRecord::Mesh) {
        const bool quads = s.flags & ShapeRecord::Quads;
        if (s.flags & ShapeRecord::Fibre) {
            const int first = int(words[s.indices + prim]);
            const float f = u >= 0 ? std::min(u, 1.0f) : 0; // not a number on a ball
            return at(first) + (at(int(end_of_segment(s, uint32_t(first)))) - at(first)) * f;
        }
        const uint32_t* index = words + s.indices + prim * (quads ? 4 : 3);
        if (!quads)
            return (1 - u - v) * at(int(index[0])) + u * at(int(index[1])) + v * at(int(index[2]));
        return (1 - u) * (1 - v) * at(int(index[0])) + u * (1 - v) * at(int(index[1])) +
               u * v * at(int(index[2])) + (1 - u) * v * at(int(index[3]));
    }
    const float x = u * float(s.nu), y = v * float(s.nv);
    const int i = std::clamp(int(x), 0, s.nu - 1), j = std::clamp(int(y), 0, s.nv - 1);
    const float fx = x - float(i), fy = y - float(j);
    const int a = j * (s.nu + 1) + i;
    return (1 - fy) * ((1 - fx) * at(a) + fx * at(a + 1)) +
           fy * ((1 - fx) * at(a + s.nu + 1) + fx * at(a + s.nu + 2));
}

void translate(Page& page, const std::array<double, 3>& by) {
    if (by == std::array<double, 3>{})
        return;
    const PageHeader& h = page.header();
    const auto moved = [&](float x, size_t c) { return float(double(x) + by[c]); };
    for (uint32_t i = 0; i < h.shapes; i++) {
        ShapeRecord s;
        std::memcpy(&s, page.words.data() + h.shapes_at + i * ShapeWords, sizeof s);
        const bool mesh = s.flags & ShapeRecord::Mesh, fibre = s.flags & ShapeRecord::Fibre;
        const size_t vertices = mesh ? size_t(s.mu) : size_t(s.mu + 1) * size_t(s.mv + 1);
        const size_t stride = fibre ? 4 : 3;
        for (int step = 0; step <= s.motion_segments; step++) {
            float* p = reinterpret_cast<float*>(page.words.data()) + s.positions +
                       size_t(step) * size_t(s.motion_stride);
            for (size_t v = 0; v < vertices; v++, p += stride)
                for (size_t c = 0; c < 3; c++)
                    p[c] = moved(p[c], c);
        }
    }
    auto* emitters = reinterpret_cast<Emitter*>(page.words.data() + h.emitters_at);
    for (uint32_t i = 0; i < h.emitters; i++)
        for (int c = 0; c < 3; c++)
            emitters[i].p0[c] = moved(emitters[i].p0[c], size_t(c));
}

uint32_t spectra_named(const Page& page) {
    const PageHeader& h = page.header();
    const uint32_t mark = std::bit_cast<uint32_t>(color::Palette::TableMark);
    uint32_t count = 0;
    const auto look = [&](uint32_t begin, uint32_t end) { // the number stands before the mark
        for (uint32_t w = begin + 1; w < end; w++)
            if (page.words[w] == mark) {
                const float number = std::bit_cast<float>(page.words[w - 1]);
                if (number >= 0 && number < 1e6f)
                    count = std::max(count, uint32_t(number) + 1);
            }
    };
    look(h.inputs_at, h.positions_at);
    look(h.emitters_at, h.words);
    return count;
}

float emitting_area(const Page& page) {
    double area = 0;
    const auto* emitters = reinterpret_cast<const Emitter*>(page.words.data() + page.header().emitters_at);
    for (uint32_t i = 0; i < page.header().emitters; i++)
        area += emitters[i].scale > 0 ? double(emitters[i].area) : 0;
    return float(area);
}

void scale_emission(Page& page, float factor) {
    auto* emitters = reinterpret_cast<Emitter*>(page.words.data() + page.header().emitters_at);
    for (uint32_t i = 0; i < page.header().emitters; i++) {
        emitters[i].scale *= factor;
        emitters[i].power *= factor;
    }
}

} // namespace kanuka::store
