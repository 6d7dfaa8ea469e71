#include "shade/textures.h"

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/texture.h>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <thread>

#include "base/latlong.h"
#include "scene/picture_name.h"
#include "shade/foreign.h"
#include "shade/linear_input.h"
#include "shade/search.h"
#include "shade/udim.h"

namespace kanuka::shade {

namespace {

constexpr float Missing = 0.5f; // mid-grey: visible, and neither pushes out nor burns
constexpr int MaxChannels = 16;

float finite(float x) {
    return std::isfinite(x) ? x : 0;
}

// Scenes name the output of MakeTexture (or of another renderer's tools); the picture it was made from does
// as well.
constexpr const char* PictureExtensions[] = {".tx", ".exr", ".tif", ".tiff", ".png", ".jpg", ".jpeg", ".hdr"};

} // namespace

struct Textures::Entry {
    std::once_flag opened;
    std::atomic<OIIO::TextureSystem::TextureHandle*> handle = nullptr; // null = missing or broken
    std::string picture;
    PictureSpace space = PictureSpace::Auto;
    bool tiled = false; // a file of the texture cache stands for the picture
    std::mutex mutex;   // of what follows, and of another handle
    bool remade = false;
    // What it is.
    bool rec709 = false; // decoded from sRGB
    OIIO::TextureOpt::Wrap s_wrap = OIIO::TextureOpt::WrapPeriodic, t_wrap = OIIO::TextureOpt::WrapPeriodic;
    std::string problem;
    std::string unread;   // what the file is, if there is one and it is no picture
    bool missing = false; // the problem is where it was looked for
};

struct Textures::Cache {
    OIIO::ImageCache* images = OIIO::ImageCache::create(false);
    OIIO::TextureSystem* system = OIIO::TextureSystem::create(false, images);
    std::shared_mutex mutex;
    std::map<std::string, Entry, std::less<>> entries[3]; // by PictureSpace
    // What OpenImageIO keeps for a thread. Its own is found by the thread and the cache's address, and
    // threads outlive caches: a later cache in the same place would find what is freed. So every call is
    // given a lease, and those that take none are made on a thread that ends before the cache.
    std::mutex idle_mutex;
    std::vector<OIIO::TextureSystem::Perthread*> idle;

    class Lease {
      public:
        explicit Lease(Cache& cache) : m_cache(cache) {
            const std::lock_guard lock(cache.idle_mutex);
            if (!cache.idle.empty()) {
                m_thread = cache.idle.back();
                cache.idle.pop_back();
            }
            m_thread = m_thread ? m_thread : cache.system->create_thread_info();
        }
        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;
        ~Lease() {
            const std::lock_guard lock(m_cache.idle_mutex);
            m_cache.idle.push_back(m_thread);
        }
        OIIO::TextureSystem::Perthread* get() const { return m_thread; }

      private:
        Cache& m_cache;
        OIIO::TextureSystem::Perthread* m_thread = nullptr;
    };

    // Null = it cannot be read.
    OIIO::TextureSystem::TextureHandle* open(const std::string& path, PictureSpace space) {
        const OIIO::ustring file(LinearInput::name_of(path, space));
        const OIIO::ImageInput::Creator creator =
            space == PictureSpace::Raw    ? LinearInput::create<PictureSpace::Raw>
            : space == PictureSpace::Srgb ? LinearInput::create<PictureSpace::Srgb>
                                          : LinearInput::create<PictureSpace::Auto>;
        std::thread([&] { images->add_file(file, creator); }).join();
        const Lease thread(*this);
        OIIO::TextureSystem::TextureHandle* handle = system->get_texture_handle(file, thread.get());
        return handle && system->imagespec(handle, thread.get()) ? handle : nullptr;
    }

    ~Cache() {
        for (OIIO::TextureSystem::Perthread* thread : idle)
            system->destroy_thread_info(thread);
        OIIO::TextureSystem::destroy(system);
        OIIO::ImageCache::destroy(images);
    }
};

Textures::Textures(std::vector<std::string> folders, size_t bytes, Journal& journal)
    : m_folders(std::move(folders)), m_journal(journal),
      m_tiled(texture_cache_folder(), texture_cache_limit(), journal), m_cache(std::make_unique<Cache>()) {
    OIIO::ImageCache& images = *m_cache->images;
    images.attribute("max_memory_MB", std::max(1.0f, float(double(bytes) / (1 << 20))));
    images.attribute("autotile", 64);
    images.attribute("automip", 1);
    images.attribute("accept_untiled", 1);
    images.attribute("accept_unmipped", 1);
    images.attribute("deduplicate", 0); // fingerprints of files that LinearInput changes would mislead
    m_cache->system->attribute("gray_to_rgb", 1);
}

Textures::~Textures() = default;

void Textures::set_space(color::Space space) {
    m_converts = space != color::Space::Rec709;
    m_space_from_rec709 = color::convert(color::Space::Rec709, space);
}

std::string Textures::find(const std::string& name) const {
    if (const auto made = m_made.find(name); made != m_made.end())
        return made->second;
    constexpr const char* as_named[] = {""};
    if (auto path = find_file(name, m_folders, as_named))
        return *path;
    // "env.xp" for env.xp.exr, as a Display wrote it.
    const std::string suffix = std::filesystem::path(name).extension().string();
    if (!suffix.empty() && !scene::is_picture_suffix(suffix))
        if (auto path = find_file(name, m_folders, PictureExtensions))
            return *path;
    // "wood.tx" for wood.png, "wood.tif.tx" for wood.tif
    const std::filesystem::path stem = std::filesystem::path(name).replace_extension();
    if (auto path = find_file(stem.string(), m_folders, as_named); path && stem.has_extension())
        return *path;
    return find_file(stem.string(), m_folders, PictureExtensions).value_or("");
}

static Digest identity_of_file(const std::string& path) {
    std::error_code failed;
    const uint64_t size = std::filesystem::file_size(path, failed);
    return digest_of(size,
                     int64_t(std::filesystem::last_write_time(path, failed).time_since_epoch().count()));
}

Digest Textures::identity(const std::string& name) const {
    if (has_tiles(name)) {
        Digester all;
        for (const std::string& file : tile_files(name, m_folders))
            all(std::filesystem::path(file).filename().string(), identity_of_file(file));
        return all.digest();
    }
    const std::string path = name.empty() ? "" : find(name);
    return path.empty() ? Digest{} : identity_of_file(path);
}

Textures::Entry& Textures::entry(const char* name, PictureSpace space) {
    const std::string_view key = name ? name : "";
    auto& entries = m_cache->entries[size_t(space)];
    Entry* entry = nullptr;
    {
        std::shared_lock lock(m_cache->mutex);
        if (const auto found = entries.find(key); found != entries.end())
            entry = &found->second;
    }
    if (!entry) {
        std::unique_lock lock(m_cache->mutex);
        entry = &entries.try_emplace(std::string(key)).first->second;
    }
    // Others may go on: a texture may first have to be made.
    std::call_once(entry->opened, [&] { open(*entry, std::string(key), space); });
    return *entry;
}

void Textures::open(Entry& entry, const std::string& name, PictureSpace space) {
    const std::string path = find(name);
    if (path.empty()) {
        entry.problem = "texture \"" + name + "\" is not found; ";
        entry.missing = true;
        return;
    }
    entry.picture = path, entry.space = space;
    OIIO::TextureSystem::TextureHandle* handle = nullptr;
    if (const auto file = m_tiled.file_of(path, space)) {
        entry.tiled = true;
        handle = m_cache->open(*file, PictureSpace::Auto);
        if (!handle && reopen(entry, nullptr))
            handle = entry.handle;
    } else {
        handle = m_cache->open(path, space);
    }
    if (!handle) {
        std::string why = m_cache->system->geterror();
        if (why.empty())
            why = m_cache->images->geterror();
        entry.unread = "texture \"" + path + "\" cannot be read" + (why.empty() ? "" : " (" + why + ")") +
                       ": it " + foreign_picture(path);
        entry.problem = entry.unread + ". Mid-grey stands in for it";
        return;
    }
    // A file made by a texture tool says how it wraps; plain pictures repeat.
    const Cache::Lease thread(*m_cache);
    const OIIO::ImageSpec* spec = m_cache->system->imagespec(handle, thread.get());
    if (const std::string wraps = spec->get_string_attribute("wrapmodes"); !wraps.empty())
        OIIO::TextureOpt::parse_wrapmodes(wraps.c_str(), entry.s_wrap, entry.t_wrap);
    entry.rec709 = spec->get_int_attribute("kanuka:rec709", 0) != 0;
    entry.handle = handle;
}

// After a file of the texture cache could not be read, by this handle: another host may have removed it. By a
// second name, since what OpenImageIO knows by the first is broken; light that is linear is the same in any
// space.
bool Textures::reopen(Entry& entry, const void* broken) {
    if (!entry.tiled)
        return false;
    const std::lock_guard lock(entry.mutex);
    if (entry.handle != broken)
        return true;
    if (std::exchange(entry.remade, true))
        return false;
    const auto file = m_tiled.remade(entry.picture, entry.space);
    OIIO::TextureSystem::TextureHandle* handle =
        file ? m_cache->open(*file, PictureSpace::Raw) : m_cache->open(entry.picture, entry.space);
    entry.handle = handle;
    return handle != nullptr;
}

std::optional<Textures::Info> Textures::info(const char* name) {
    const std::vector<std::string> tiles = name ? tile_files(name, m_folders) : std::vector<std::string>{};
    Entry& e = entry(tiles.empty() ? name : tiles[0].c_str(), PictureSpace::Auto);
    const Cache::Lease thread(*m_cache);
    const OIIO::ImageSpec* spec = e.handle ? m_cache->system->imagespec(e.handle, thread.get()) : nullptr;
    if (!spec) {
        if (!e.unread.empty())
            m_journal.error(Location{}, e.unread);
        return std::nullopt;
    }
    const std::string kind = spec->get_string_attribute("textureformat");
    return Info{spec->full_width, spec->full_height, spec->nchannels,
                kind.find("nvironment") != std::string::npos ||
                    spec->get_int_attribute("kanuka:environment") != 0};
}

static PictureSpace space_of(std::string_view named) {
    return named == "raw" ? PictureSpace::Raw : named == "srgb" ? PictureSpace::Srgb : PictureSpace::Auto;
}

void Textures::lookup_tiles(const sl::TextureRequest& request, const Location& asker) {
    const std::string name = request.file;
    const PictureSpace space = space_of(request.space ? request.space : "");
    const std::vector<int> tiles =
        tiles_of(request, [&](int tile) { return !entry(tile_name(name, tile).c_str(), space).missing; });
    for (const int tile : std::set<int>(tiles.begin(), tiles.end())) {
        TileRequest part(request, tiles, tile);
        const std::string file = tile_name(name, tile);
        lookup(part.request(file), asker);
        part.scatter(request);
    }
}

void Textures::lookup(const sl::TextureRequest& request, const Location& asker) {
    if (request.file && has_tiles(request.file))
        return lookup_tiles(request, asker);
    const std::string_view named = request.space ? request.space : "";
    Entry& entry = this->entry(request.file, space_of(named));
    if (!named.empty() && named != "raw" && named != "srgb" && named != "auto")
        m_journal.warning(asker, "texture(): there is no colorspace \"" + std::string(named) +
                                     "\"; there are auto, raw and srgb. Taken as auto");
    const int channels = std::clamp(request.channels, 0, MaxChannels);
    const auto store = [&](int point, const float* values) {
        for (int c = 0; c < channels; c++)
            request.result[size_t(c) * size_t(request.result_stride) + size_t(point)] = finite(values[c]);
    };
    const float grey[MaxChannels] = {Missing, Missing, Missing, Missing, Missing, Missing, Missing, Missing,
                                     Missing, Missing, Missing, Missing, Missing, Missing, Missing, Missing};
    OIIO::TextureSystem::TextureHandle* handle = entry.handle;
    if (!handle) {
        m_journal.error(asker, !entry.missing ? entry.problem
                                              : entry.problem + searched_in(m_folders, "texture", asker) +
                                                    ". Mid-grey stands in for it");
        for (int i = 0; i < request.count; i++)
            store(i, grey);
        return;
    }
    OIIO::TextureSystem& system = *m_cache->system;
    const Cache::Lease thread(*m_cache);
    // Channels that the file has not are filled. (The library asserts that there is one that it has.)
    if (const OIIO::ImageSpec* spec = system.imagespec(handle, thread.get());
        channels == 0 || !spec || request.first_channel >= spec->nchannels) {
        float fill[MaxChannels];
        std::fill_n(fill, MaxChannels, request.fill);
        for (int i = 0; i < request.count; i++)
            store(i, fill);
        return;
    }
    OIIO::TextureOpt options;
    options.firstchannel = std::max(0, request.first_channel);
    options.swrap = entry.s_wrap, options.twrap = entry.t_wrap;
    if (request.wrap && *request.wrap)
        OIIO::TextureOpt::parse_wrapmodes(request.wrap, options.swrap, options.twrap);
    options.sblur = options.tblur = std::clamp(finite(request.blur), 0.0f, 1024.0f);
    options.swidth = options.twidth = std::clamp(finite(request.width), 0.0f, 1024.0f);
    options.fill = request.fill;
    // A point of infinite coordinates has no place on the picture: its corner will do. Far out single
    // precision knows no texel, and numbers of texels would not be whole numbers any more.
    static constexpr float Farthest = 1 << 20;
    const auto at = [](const float* values, int i) {
        return values ? std::clamp(finite(values[i]), -Farthest, Farthest) : 0.0f;
    };
    for (int i = 0; i < request.count; i++) {
        float values[MaxChannels] = {};
        const auto look = [&] {
            return system.texture(handle, thread.get(), options, at(request.s, i), at(request.t, i),
                                  at(request.dsdu, i), at(request.dtdu, i), at(request.dsdv, i),
                                  at(request.dtdv, i), channels, values);
        };
        bool found = look();
        if (!found && reopen(entry, handle)) {
            handle = entry.handle;
            found = look();
        }
        if (found) {
            if (m_converts && entry.rec709 && channels >= 3 && options.firstchannel == 0) {
                const Rgb c = color::transform(m_space_from_rec709, {values[0], values[1], values[2]});
                values[0] = c.x, values[1] = c.y, values[2] = c.z;
            }
            store(i, values);
            continue;
        }
        m_journal.error(asker, "texture \"" + std::string(request.file) + "\" cannot be read (" +
                                   system.geterror() + "); mid-grey stands in where it is broken");
        store(i, grey);
    }
}

void Textures::lookup_environment(const sl::TextureRequest& request, const float* x, const float* y,
                                  const float* z, const Location& asker) {
    constexpr int Block = 64;
    float s[Block], t[Block], zero[Block] = {};
    for (int begin = 0; begin < request.count; begin += Block) {
        const int count = std::min(Block, request.count - begin);
        for (int i = 0; i < count; i++) {
            const Vec3f d(x[begin + i], y[begin + i], z[begin + i]);
            const LatLongPlace place = latlong_place({finite(d.x), finite(d.y), finite(d.z)});
            s[i] = place.u, t[i] = place.v;
        }
        sl::TextureRequest block = request;
        block.s = s, block.t = t;
        block.dsdu = block.dtdu = block.dsdv = block.dtdv = zero;
        block.count = count;
        block.wrap = "periodic,clamp";
        block.result = request.result + begin;
        lookup(block, asker);
    }
}

uint64_t Textures::bytes() const {
    OIIO::imagesize_t used = 0;
    m_cache->images->getattribute("stat:cache_memory_used", OIIO::TypeDesc::INT64, &used);
    return uint64_t(used);
}

} // namespace kanuka::shade
