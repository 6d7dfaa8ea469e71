// Grids to pages: their sections one after another.
#include <cstring>

#include "base/tasks.h"
#include "store/encode_grid.h"

namespace kanuka::store {

template <class T>
static uint32_t* bytes_at(Page& page, uint32_t at, const std::vector<T>& source) {
    if (!source.empty())
        std::memcpy(page.words.data() + at, source.data(), source.size() * sizeof(T));
    return page.words.data() + at;
}

// Offsets have 31 bits.
static void refuse_too_long(const std::vector<Encoded>& encoded) {
    uint64_t words = 0;
    for (const Encoded& e : encoded) {
        const uint64_t positions = e.positions.size() * (1 + e.later.size());
        words += ShapeWords + e.table.size() + e.inputs.size() + positions + e.indices.size() +
                 e.emitters.size() * (sizeof(Emitter) / 4);
    }
    if (words > Store::LargestWindow - 4096)
        throw Error("it takes " + std::to_string(words * 4 >> 30) +
                    " GiB of grids, and one primitive may have 8: a larger shading rate, or splitting it up "
                    "would do");
}

Page encode(std::span<const ShadedGrid> grids, const grid::LayeringProgram& program, uint64_t& bad_inputs,
            const color::Palette* palette, uint64_t* lost) {
    static const color::Palette rec709;
    const grid::WordLayout layout(program);
    std::vector<Encoded> encoded(grids.size());
    tasks::parallel_for(grids.size(), [&](size_t i) {
        encode_grid(grids[i], program, layout, palette ? *palette : rec709, encoded[i]);
    });

    // Sections one after another; each grid's part of each section one after another.
    struct Offsets {
        uint32_t table = 0, inputs = 0, positions = 0, indices = 0, emitters = 0;
    };
    std::vector<Offsets> at(grids.size() + 1);
    for (size_t i = 0; i < grids.size(); i++) {
        const Encoded& e = encoded[i];
        at[i + 1] = {at[i].table + uint32_t(e.table.size()), at[i].inputs + uint32_t(e.inputs.size()),
                     at[i].positions + uint32_t(e.positions.size()),
                     at[i].indices + uint32_t(e.indices.size()),
                     at[i].emitters + uint32_t(e.emitters.size())};
    }
    const Offsets& total = at.back();
    refuse_too_long(encoded);
    const auto round_up = [](uint64_t n, uint64_t m) { return uint32_t((n + m - 1) / m * m); };
    PageHeader h{};
    h.magic = PageMagic;
    h.version = PageVersion;
    h.shapes = uint32_t(grids.size());
    h.shapes_at = round_up(sizeof(PageHeader) / 4, 16);
    h.tables_at = h.shapes_at + h.shapes * ShapeWords;
    h.inputs_at = h.tables_at + total.table;
    // Whole triples, and whole rows of four: the ray tracer reads those of fibres as aligned ones.
    h.positions_at = round_up(h.inputs_at + total.inputs, 12);
    // All positions at the first step, then all at the next one, …: the ray tracer finds a step at one
    // distance.
    const uint32_t segments = grids.empty() ? 0 : uint32_t(grids[0].grid->later.size());
    h.indices_at = h.positions_at + total.positions * (segments + 1);
    h.emitters_at = h.indices_at + total.indices;
    h.emitters = total.emitters;
    h.words = h.emitters_at + total.emitters * uint32_t(sizeof(Emitter) / 4);
    h.grid_bytes =
        (h.shapes * ShapeWords + total.table + total.positions * (segments + 1) + total.indices) * 4;
    h.input_bytes = total.inputs * 4;

    Page page;
    page.words.assign(h.words, 0);
    tasks::parallel_for(grids.size(), [&](size_t i) {
        Encoded& e = encoded[i];
        const Offsets& o = at[i];
        for (size_t w = 0; w < e.table.size(); w += 2)
            e.table[w] += h.inputs_at + o.inputs;
        e.shape.slot_table = int32_t(h.tables_at + o.table);
        e.shape.positions = int32_t(h.positions_at + o.positions);
        e.shape.motion_stride = int32_t(total.positions);
        e.shape.indices = e.indices.empty() ? -1 : int32_t(h.indices_at + o.indices);
        if (e.shape.emitter >= 0)
            e.shape.emitter = int32_t(o.emitters);
        bytes_at(page, h.tables_at + o.table, e.table);
        bytes_at(page, h.inputs_at + o.inputs, e.inputs);
        bytes_at(page, h.positions_at + o.positions, e.positions);
        for (uint32_t k = 0; k < std::min(segments, uint32_t(e.later.size())); k++)
            bytes_at(page, h.positions_at + (k + 1) * total.positions + o.positions, e.later[k]);
        bytes_at(page, h.indices_at + o.indices, e.indices);
        bytes_at(page, h.emitters_at + o.emitters * uint32_t(sizeof(Emitter) / 4), e.emitters);
        std::memcpy(page.words.data() + h.shapes_at + i * ShapeWords, &e.shape, sizeof e.shape);
    });
    for (size_t i = 0; i < grids.size(); i++) {
        const ShapeRecord& s = encoded[i].shape;
        bad_inputs += encoded[i].bad;
        if (lost)
            *lost += encoded[i].lost;
        h.vertices += uint32_t(grids[i].grid->vertices());
        h.micropolygons += grids[i].mesh ? uint32_t(s.mv) : uint32_t(s.nu * s.nv);
        h.traced_polygons += grids[i].mesh ? uint32_t(s.mv) : uint32_t(s.mu * s.mv);
    }
    page.header() = h;
    return page;
}

} // namespace kanuka::store
