#include "shade/texture_cache.h"

#include <OpenImageIO/imageio.h>
#include <cstdlib>
#include <filesystem>
#include <unistd.h>

#include "base/byte_size.h"
#include "base/digest.h"
#include "base/tasks.h"
#include "shade/linear_input.h"
#include "shade/make_texture.h"

namespace kanuka::shade {

namespace fs = std::filesystem;

namespace {

constexpr uint32_t Version = 1;                   // of what is made of a picture
constexpr uint64_t LeastPixels = 512 * 512;       // smaller ones are read as quickly as they are
constexpr uint64_t MostBytes = uint64_t(2) << 30; // of pictures at work at the same time, but for one

struct Plain {
    uint64_t bytes; // in floats, with its levels
    bool environment;
};

// None: the picture serves as it is, or cannot be read.
std::optional<Plain> look_at(const std::string& picture, PictureSpace space) {
    LinearInput file(space);
    OIIO::ImageSpec spec;
    if (!file.open(LinearInput::name_of(picture, space), spec))
        return std::nullopt;
    const bool whole = spec.x == spec.full_x && spec.y == spec.full_y && spec.width == spec.full_width &&
                       spec.height == spec.full_height;
    if (!whole || uint64_t(spec.width) * uint64_t(spec.height) < LeastPixels)
        return std::nullopt;
    if (spec.tile_width > 0 && file.seek_subimage(0, 1))
        return std::nullopt;
    return Plain{uint64_t(spec.width) * uint64_t(spec.height) * uint64_t(spec.nchannels) * sizeof(float) * 4 /
                     3,
                 spec.get_string_attribute("textureformat").find("nvironment") != std::string::npos};
}

} // namespace

// Waits until there is memory for a picture.
class TextureCache::Working {
  public:
    Working(TextureCache& cache, uint64_t bytes) : m_cache(cache), m_bytes(bytes) {
        std::unique_lock lock(cache.m_mutex);
        cache.m_done.wait(
            lock, [&] { return cache.m_working_bytes == 0 || cache.m_working_bytes + bytes <= MostBytes; });
        cache.m_working_bytes += bytes;
    }
    ~Working() {
        {
            const std::lock_guard lock(m_cache.m_mutex);
            m_cache.m_working_bytes -= m_bytes;
        }
        m_cache.m_done.notify_all();
    }
    Working(const Working&) = delete;

  private:
    TextureCache& m_cache;
    uint64_t m_bytes;
};

TextureCache::TextureCache(std::string folder, uint64_t most_bytes, Journal& journal)
    : m_folder(std::move(folder)), m_most_bytes(most_bytes), m_journal(journal) {}

TextureCache::~TextureCache() {
    std::error_code ignored;
    if (!m_own_folder.empty())
        fs::remove_all(m_own_folder, ignored);
}

// By where the picture is, how large, and when it was written: one that is painted anew has another file.
std::string TextureCache::path_of(const std::string& picture, PictureSpace space,
                                  const std::string& folder) const {
    std::error_code failed;
    const fs::path whole = fs::weakly_canonical(picture, failed);
    const uint64_t size = fs::file_size(picture, failed);
    const auto written = fs::last_write_time(picture, failed).time_since_epoch().count();
    const Digest digest = digest_of(Version, whole.string(), size, int64_t(written), space);
    return (fs::path(folder) /
            (fs::path(picture).stem().string() + "." + digest.text() + std::string(TextureFiles.suffix)))
        .string();
}

std::string TextureCache::own_folder() {
    const std::lock_guard lock(m_mutex);
    if (m_own_folder.empty()) {
        std::error_code failed;
        std::string made = (fs::temp_directory_path(failed) / "kanuka-textures-XXXXXX").string();
        if (!failed && mkdtemp(made.data()))
            m_own_folder = made;
    }
    return m_own_folder;
}

std::optional<std::string> TextureCache::make(const std::string& picture, PictureSpace space, bool to_keep) {
    const auto plain = look_at(picture, space);
    if (!plain)
        return std::nullopt;
    const Working working(*this, plain->bytes);
    TextureMaking making{.pictures = {picture},
                         .s_wrap = "periodic",
                         .t_wrap = "periodic",
                         .space = space,
                         .unfinished_suffix = TextureFiles.unfinished_suffix};
    if (plain->environment)
        making.kind = TextureMaking::Kind::LatLong;
    std::string problem;
    for (const bool own : {false, true}) {
        if (!own && !to_keep)
            continue;
        const std::string folder = own ? own_folder() : m_folder;
        std::error_code failed;
        fs::create_directories(folder, failed);
        making.texture = path_of(picture, space, folder);
        try {
            // Threads that wait here hold what others wait for.
            tasks::isolated([&] { make_texture(making); });
        } catch (const Error& e) {
            problem = e.what();
            if (e.code() != ExitCode::Output)
                break; // of the picture, which another folder will not mend
            if (!own)  // the same words each time: told once
                m_journal.warning({m_folder},
                                  "the texture cache cannot be written: textures are made anew by "
                                  "each render. Look at the folder's permissions and room; "
                                  "KANUKA_TEXTURE_CACHE names another");
            continue;
        }
        m_made++;
        if (!own)
            make_room_in_cache(m_folder, TextureFiles, fs::file_size(making.texture, failed), m_most_bytes);
        return making.texture;
    }
    m_journal.warning({picture},
                      "no tiled texture was made of it (" + problem + "): it is read as it is, slowly");
    return std::nullopt;
}

std::optional<std::string> TextureCache::file_of(const std::string& picture, PictureSpace space) {
    std::string kept = path_of(picture, space, m_folder);
    std::error_code failed;
    if (fs::is_regular_file(kept, failed)) {
        note_use(kept);
        return kept;
    }
    return make(picture, space, true);
}

std::optional<std::string> TextureCache::remade(const std::string& picture, PictureSpace space) {
    const std::string kept = path_of(picture, space, m_folder);
    std::error_code ignored;
    const bool damaged = fs::remove(kept, ignored);
    if (damaged)
        m_journal.warning({kept}, "a file of the texture cache is damaged: it is made anew");
    return make(picture, space, damaged);
}

std::string texture_cache_folder() {
    return cache_folder("KANUKA_TEXTURE_CACHE", "textures");
}

uint64_t texture_cache_limit() {
    constexpr uint64_t DefaultLimit = uint64_t(20) << 30;
    const char* given = std::getenv("KANUKA_TEXTURE_CACHE_SIZE");
    return parse_byte_size(given ? given : "").value_or(DefaultLimit);
}

} // namespace kanuka::shade
