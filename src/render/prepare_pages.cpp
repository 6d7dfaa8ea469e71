// Pages that need not be made: kept in memory by earlier makings, or on disk by earlier renders; and their
// keys.
#include <algorithm>

#include "render/prepare.h"
#include "scene/digest.h"

namespace kanuka::render {

// ---- pages that are kept

Preparer::Preparer(const GeometryRequest& request) : m_request(request) {
    if (!request.pages)
        return;
    const dice::DiceOptions& o = request.dice;
    const dice::DicingCamera& c = o.camera;
    m_setting.options = digest_of(store::PageVersion, request.setting, request.classic, request.shutter.open,
                                  request.shutter.close);
    m_setting.rates = digest_of(o.shading_rate_scale, o.max_grid_cells, o.geometry_tolerance,
                                o.normal_tolerance, o.max_micropolygons);
    m_setting.lens = digest_of(c.projection, c.pixels_per_tangent, c.pixel_stretch, c.half_angle, c.near_clip,
                               c.width, c.height, c.middle_x, c.middle_y, c.offscreen_falloff);
}

bool Preparer::asks_world(const shade::SpacesRead& read) {
    return std::ranges::any_of(
        read.transforms, [](const auto& pair) { return pair.first == "world" || pair.second == "world"; });
}

bool Preparer::take_kept(Prepared& out) {
    const shade::Material& material = *out.material;
    const std::optional<PageCache::Entry> known = m_request.pages->find(
        out.content, [&](const PageCache::Entry& e) { return material.digest_of(e.read) == e.of_read; });
    if (!known)
        return false;
    out.is_evicted = !known->made;
    if (out.is_evicted)
        return false;
    out.key = digest_of(out.content, known->of_read);
    out.page = known->made->page;
    out.empty = known->made->empty;
    out.asks_world = asks_world(known->read);
    m_request.stats.count.primitives_kept += 1;
    if (m_request.made_again)
        out.inputs.note_read(known->read, material);
    return true;
}

void Preparer::note_made(shade::SpacesRead read, Prepared& out) const {
    const Digest of_read = out.material->digest_of(read);
    if (out.is_evicted && !out.is_stored)
        m_request.stats.count.primitives_evicted += 1;
    out.key = digest_of(out.content, of_read);
    if (keeps())
        out.made =
            PageCache::Entry{std::move(read), of_read,
                             std::make_shared<const PageCache::Made>(PageCache::Made{out.page, out.empty})};
}

// ---- and those on disk

namespace {

// SpacesRead as a text: what is read by itself, then the number of pairs of spaces, then names.
std::string text_of(const shade::SpacesRead& read) {
    std::string text(1, char('0' + int(read.eye) + 2 * int(read.world)));
    const auto add = [&](const std::string& name) { text.append(name).append(1, '\0'); };
    add(std::to_string(read.transforms.size()));
    for (const auto& [to, from] : read.transforms)
        add(to), add(from);
    for (const std::string& file : read.files)
        add(file);
    return text;
}

std::optional<shade::SpacesRead> spaces_of(const std::string& text) {
    if (text.empty() || text[0] < '0' || text[0] > '3' || text.back() != '\0')
        return std::nullopt;
    shade::SpacesRead read;
    read.eye = (text[0] - '0') & 1, read.world = (text[0] - '0') & 2;
    std::vector<std::string> names;
    for (size_t at = 1, end; at < text.size(); at = end + 1) {
        end = text.find('\0', at);
        names.push_back(text.substr(at, end - at));
    }
    const size_t pairs = std::strtoull(names[0].c_str(), nullptr, 10);
    if (pairs > (names.size() - 1) / 2)
        return std::nullopt;
    for (size_t i = 0; i < pairs; i++)
        read.transforms.emplace(names[1 + 2 * i], names[2 + 2 * i]);
    read.files.insert(names.begin() + ptrdiff_t(1 + 2 * pairs), names.end());
    return read;
}

// Of the first so many of a palette's measured spectra; null = there are fewer.
std::optional<Digest> digest_of_spectra(const color::Palette& palette, uint32_t count) {
    const std::vector<float> tables = palette.tables();
    const size_t floats = size_t(count) * color::Palette::TableStride;
    if (tables.size() < floats)
        return std::nullopt;
    return digest_of(std::span<const float>(tables.data(), floats));
}

} // namespace

bool Preparer::take_stored(Prepared& out) {
    if (!m_request.disk)
        return false;
    const auto start = Clock::now();
    for (const store::StoredPage& stored : m_request.disk->find(out.content)) {
        std::optional<shade::SpacesRead> read = spaces_of(stored.reads);
        if (!read || out.material->digest_of(*read) != stored.of_read)
            continue;
        if (stored.spectra > 0 && digest_of_spectra(m_request.palette, stored.spectra) != stored.palette)
            continue;
        store::Page page;
        if (!m_request.disk->read(stored, out.material->program(), page))
            continue;
        out.page = std::move(page);
        out.empty = stored.empty;
        out.is_stored = true;
        out.asks_world = asks_world(*read);
        m_request.stats.count.primitives_stored += 1;
        if (m_request.made_again)
            out.inputs.note_read(*read, *out.material);
        note_made(std::move(*read), out);
        m_store_time += std::chrono::duration<double>(Clock::now() - start).count();
        return true;
    }
    return false;
}

store::StoredPage Preparer::entry_of(const Prepared& made) const {
    store::StoredPage stored;
    stored.content = made.content;
    stored.of_read = made.made->of_read;
    stored.reads = text_of(made.made->read);
    stored.empty = made.made->made->empty;
    if (!stored.empty)
        stored.spectra = store::spectra_named(made.made->made->page);
    if (stored.spectra > 0)
        stored.palette = digest_of_spectra(m_request.palette, stored.spectra).value_or(Digest());
    return stored;
}

// All that a page is made of, but for what shaders read of where the primitive stands.
PageInputs Preparer::inputs_of(const scene::Primitive& declared, const shade::Material& material,
                               const PageFrame& frame, const dice::DiceTarget& target, bool inside_out) {
    PageInputs inputs = m_setting;
    Digester shape;
    scene::put_shape(shape, declared);
    inputs.shape = shape.digest();
    inputs.attributes = declared.attributes;
    inputs.of_attributes = key_of(declared.attributes.get());
    inputs.material = material.hash();
    inputs.place = digest_of(frame.page_from_object);
    inputs.cameras = digest_of(frame.cameras, frame.border, target.pixels_per_unit, target.finer,
                               target.instead_from.empty());
    if (target.field)
        inputs.oracle = digest_of(target.field->lower, target.field->per_unit,
                                  std::span<const float>(target.field->factor));
    inputs.inside_out = inside_out;
    return inputs;
}

Digest Preparer::key_of(const scene::Attributes* attributes) {
    if (!attributes)
        return {};
    {
        const std::lock_guard lock(m_attributes_mutex);
        if (const auto found = m_attributes.find(attributes); found != m_attributes.end())
            return found->second;
    }
    const Digest digest = scene::digest_apart(*attributes);
    const std::lock_guard lock(m_attributes_mutex);
    return m_attributes.try_emplace(attributes, digest).first->second;
}

} // namespace kanuka::render
