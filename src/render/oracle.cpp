#include "render/oracle.h"

#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>

#include "base/error.h"
#include "film/atomic_file.h"
#include "render/de_instance.h"
#include "scene/bounds.h"

namespace kanuka::render {

namespace {

constexpr uint32_t Magic = 0x524f4d4b, Version = 1; // "KMOR"

struct Header {
    uint32_t magic = Magic, version = Version;
    uint64_t primitives = 0, lattices = 0;
};
struct FileEntry {
    Digest key;
    int64_t lattice;
};
static_assert(sizeof(Header) == 24 && sizeof(FileEntry) == 24); // no padding: they are written as they are

// Boxes of displaced shapes are larger than those of their points; what lies outside counts at the border.
// Flat ones have a little thickness.
void fit(const Bounds3f& box, Vec3f& lower, Vec3f& per_unit) {
    const Vec3f extent = box.hi - box.lo;
    const float least = 1e-4f * std::max({extent.x, extent.y, extent.z, 1e-20f});
    lower = box.lo;
    for (int a = 0; a < 3; a++)
        per_unit[a] = float(DicingOracle::Cells) / std::max(extent[a], least);
}

} // namespace

Digest oracle_key(const scene::Primitive& primitive) {
    return digest_of(primitive.attributes ? std::string_view(primitive.attributes->name) : std::string_view(),
                     primitive.id);
}

// ---- what was found

uint8_t DicingOracle::code_of(float factor) {
    const float steps = std::ceil(std::log2(std::clamp(factor, Least, Most)) * float(StepsAnOctave) - 1e-3f);
    return uint8_t(One + int(steps));
}

float DicingOracle::factor_of(uint8_t code) {
    return code == 0 ? Least : std::exp2(float(int(code) - One) / float(StepsAnOctave));
}

void DicingOracle::add(const Digest& key, const Lattice* lattice) {
    m_known[key] = lattice ? int64_t(m_lattices.size()) : -1;
    if (lattice)
        m_lattices.push_back(*lattice);
}

std::unique_ptr<const dice::DensityField> DicingOracle::field(const scene::Primitive& primitive) const {
    const auto known = m_known.find(oracle_key(primitive));
    const Bounds3f box = scene::object_bounds(primitive);
    if (known == m_known.end() || box.empty())
        return nullptr;
    auto field = std::make_unique<dice::DensityField>();
    fit(box, field->lower, field->per_unit);
    if (known->second < 0) {
        field->factor.fill(Least);
        return field;
    }
    // A vertex has the most of the cells around it: the factor is nowhere less than a cell's own.
    const Lattice& lattice = m_lattices[size_t(known->second)];
    bool plain = true;
    size_t vertex = 0;
    constexpr int V = dice::DensityField::Vertices;
    for (int z = 0; z < V; z++)
        for (int y = 0; y < V; y++)
            for (int x = 0; x < V; x++) {
                uint8_t most = 0;
                for (int k = std::max(z - 1, 0); k <= std::min(z, Cells - 1); k++)
                    for (int j = std::max(y - 1, 0); j <= std::min(y, Cells - 1); j++)
                        for (int i = std::max(x - 1, 0); i <= std::min(x, Cells - 1); i++)
                            most = std::max(most, lattice[size_t((k * Cells + j) * Cells + i)]);
                plain &= most == One;
                field->factor[vertex++] = factor_of(most);
            }
    return plain ? nullptr : std::move(field);
}

void DicingOracle::save(const std::string& path) const {
    film::AtomicFile file(path);
    Digester sum;
    const auto write = [&](const void* data, size_t size) {
        file.write(data, size);
        sum.bytes(data, size);
    };
    const Header header{.primitives = m_known.size(), .lattices = m_lattices.size()};
    write(&header, sizeof header);
    for (const auto& [key, lattice] : m_known) {
        const FileEntry entry{key, lattice};
        write(&entry, sizeof entry);
    }
    write(m_lattices.data(), m_lattices.size() * sizeof(Lattice));
    const Digest whole = sum.digest();
    file.write(&whole, sizeof whole);
    file.commit();
}

DicingOracle DicingOracle::load(const std::string& path) {
    const auto refuse = [&](const std::string& why) {
        return Error(Location{path}, why + "; write it anew (kanuka render --write-oracle)");
    };
    struct Closer {
        void operator()(std::FILE* f) const { std::fclose(f); }
    };
    const std::unique_ptr<std::FILE, Closer> file(std::fopen(path.c_str(), "rb"));
    if (!file)
        throw Error(Location{path}, std::string("cannot be opened: ") + std::strerror(errno));
    const auto seek = [&](long to, int from) {
        if (std::fseek(file.get(), to, from) != 0)
            throw Error(Location{path}, std::string("cannot be read: ") + std::strerror(errno));
    };
    seek(0, SEEK_END);
    const uint64_t size = uint64_t(std::max<long>(std::ftell(file.get()), 0));
    seek(0, SEEK_SET);
    Digester sum;
    const auto read = [&](void* data, size_t bytes) {
        if (bytes > 0 && std::fread(data, bytes, 1, file.get()) != 1)
            throw refuse("the oracle ends early");
        sum.bytes(data, bytes);
    };
    Header header;
    if (size < sizeof header)
        throw refuse("this is no dicing oracle");
    read(&header, sizeof header);
    if (header.magic != Magic)
        throw refuse("this is no dicing oracle");
    if (header.version != Version)
        throw refuse("the oracle is of another version of Kanuka");
    const uint64_t rest = size - sizeof header;
    if (header.primitives > rest / sizeof(FileEntry) || header.lattices > rest / sizeof(Lattice) ||
        header.primitives * sizeof(FileEntry) + header.lattices * sizeof(Lattice) + sizeof(Digest) != rest)
        throw refuse("the oracle is damaged: its size is not what it says");
    std::vector<FileEntry> entries(header.primitives);
    DicingOracle oracle;
    oracle.m_lattices.resize(header.lattices);
    read(entries.data(), entries.size() * sizeof(FileEntry));
    read(oracle.m_lattices.data(), oracle.m_lattices.size() * sizeof(Lattice));
    const Digest whole = sum.digest();
    Digest written;
    read(&written, sizeof written);
    if (written != whole)
        throw refuse("the oracle is damaged: its checksum does not match");
    for (const FileEntry& entry : entries) {
        if (entry.lattice < -1 || entry.lattice >= int64_t(header.lattices))
            throw refuse("the oracle is damaged");
        oracle.m_known[entry.key] = entry.lattice;
    }
    return oracle;
}

// ---- what is found

struct OracleRecorder::Seen {
    using Counts = std::array<std::atomic<uint16_t>, DicingOracle::Codes>; // of hits, by what they want
    std::array<Counts, std::tuple_size_v<DicingOracle::Lattice>> cells{};

    void count(size_t cell, uint8_t code) {
        std::atomic<uint16_t>& n = cells[cell][size_t(code - DicingOracle::LeastCode)];
        for (uint16_t seen = n; seen < UINT16_MAX && !n.compare_exchange_weak(seen, uint16_t(seen + 1));)
            ;
    }
    // The least that all but a tenth are content with; 0 = nobody came.
    uint8_t code(size_t cell) const {
        constexpr uint32_t Part = 10;
        uint32_t all = 0, finer = 0;
        for (const auto& n : cells[cell])
            all += n;
        if (all == 0)
            return 0;
        int k = DicingOracle::Codes - 1;
        for (; k > 0; k--) {
            finer += cells[cell][size_t(k)];
            if (finer * Part > all)
                break;
        }
        return uint8_t(DicingOracle::LeastCode + k);
    }
};

OracleRecorder::~OracleRecorder() = default;

OracleRecorder::OracleRecorder(const scene::Scene& scene, const Transform& render_from_world,
                               const dice::DiceOptions& options) {
    const GroupViews views(scene, 0, render_from_world, options.camera);
    const float pixels = options.camera.finest_pixels();
    m_pixel_spread = 1 / std::max(pixels, 1e-6f);
    m_spaces.push_back(std::make_unique<dice::Density>(dice::DiceTarget{}, options, 1.0f));
    for (const scene::Primitive& p : scene.primitives)
        add(p, render_from_world, 0);
    std::set<int> unique;
    const auto note_unique = [&](const std::vector<scene::Group::Instances>& all) {
        for (const scene::Group::Instances& in : all)
            if (are_unique(in))
                unique.insert(in.group);
    };
    note_unique(scene.instances);
    for (const scene::Group& group : scene.groups)
        note_unique(group.instances);
    for (size_t g = 0; g < scene.groups.size(); g++) {
        dice::DiceTarget target;
        target.instead_from = views[g].cameras;
        if (target.instead_from.empty())
            target.pixels_per_unit = views[g].pixels_per_unit;
        m_spaces.push_back(std::make_unique<dice::Density>(target, options, 1.0f));
        const Vec3f& c = views[g].center;
        const Transform built_from_group = Transform::translate(-double(c.x), -double(c.y), -double(c.z));
        // Copies of what is unique share its ids, and stand elsewhere.
        if (!unique.contains(int(g)))
            for (const scene::Primitive& p : scene.groups[g].primitives)
                add(p, built_from_group, int(g) + 1);
    }
}

void OracleRecorder::add(const scene::Primitive& primitive, const Transform& space_from_parent, int space) {
    const Bounds3f box = scene::object_bounds(primitive);
    if (primitive.motion || box.empty() || primitive.id < 0)
        return;
    auto entry = std::make_unique<Entry>();
    try {
        entry->object_from_shape = (space_from_parent * *primitive.world_from_object).inverse();
    } catch (const Error&) {
        return; // flattened: nothing is seen of it
    }
    entry->key = oracle_key(primitive);
    entry->space = space;
    fit(box, entry->lower, entry->per_unit);
    if (m_entries.size() <= size_t(primitive.id))
        m_entries.resize(size_t(primitive.id) + 1);
    m_entries[size_t(primitive.id)] = std::move(entry);
}

void OracleRecorder::note(const transport::Footprint& footprint) {
    if (footprint.object < 0 || size_t(footprint.object) >= m_entries.size() ||
        !m_entries[size_t(footprint.object)] || !(footprint.width >= 0))
        return;
    Entry& entry = *m_entries[size_t(footprint.object)];
    Vec3f p = footprint.P;
    float scale = 1; // units of the world in one of the shape's space
    if ((entry.space > 0) != (footprint.world_from_shape != nullptr))
        return; // a part of the world that moves
    if (const float* m = footprint.world_from_shape) {
        Transform world_from_shape;
        for (size_t i = 0; i < 12; i++)
            world_from_shape.m[i / 4][i % 4] = double(m[i]);
        try {
            p = world_from_shape.inverse().point(p);
        } catch (const Error&) {
            return;
        }
        scale = float(std::cbrt(std::abs(world_from_shape.determinant3())));
    }
    const float asked = m_spaces[size_t(entry.space)]->pixels_per_unit(p),
                wanted = scale / std::max(footprint.width, 1e-30f);
    const Vec3f in_object = entry.object_from_shape.point(p);
    size_t cell = 0;
    for (int a = 2; a >= 0; a--) {
        const float x = (in_object[a] - entry.lower[a]) * entry.per_unit[a];
        const float inside =
            x > 0 ? std::min(x, float(DicingOracle::Cells - 1)) : 0.0f; // no number: anywhere
        cell = cell * DicingOracle::Cells + size_t(inside);
    }
    Seen* seen = entry.seen;
    if (!seen) {
        const std::lock_guard lock(m_mutex);
        seen = entry.seen;
        if (!seen) {
            m_all.push_back(std::make_unique<Seen>());
            entry.seen = seen = m_all.back().get();
        }
    }
    const float factor = wanted / std::max(asked, 1e-30f);
    if (!(factor >= 0))
        return;
    seen->count(cell, DicingOracle::code_of(factor));
}

DicingOracle OracleRecorder::result() const {
    DicingOracle oracle;
    for (const auto& entry : m_entries) {
        if (!entry)
            continue;
        const Seen* const seen = entry->seen;
        DicingOracle::Lattice lattice;
        for (size_t i = 0; seen && i < lattice.size(); i++)
            lattice[i] = seen->code(i);
        oracle.add(entry->key, seen ? &lattice : nullptr);
    }
    return oracle;
}

} // namespace kanuka::render
