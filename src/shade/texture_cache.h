// Plain pictures as tiled, mip-mapped files, made once and kept in a folder that many hosts may share.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/cache_folder.h"
#include "base/error.h"
#include "shade/picture_space.h"

namespace kanuka::shade {

inline constexpr CacheKind TextureFiles{".tiled.exr", ".tiled.part", std::chrono::hours(1)};

// What a large picture is looked up in is always such a file, whether it was there or is made now: a render's
// bits do not depend on the folder. Where the folder cannot be written, files are made in one that goes with
// the render. Thread safety: all members may be called from any thread.
class TextureCache {
  public:
    TextureCache(std::string folder, uint64_t most_bytes, Journal& journal);
    ~TextureCache();
    TextureCache(const TextureCache&) = delete;

    // The file that stands for a picture; none: it is small, has tiles and levels of its own, shows another
    // part of its canvas than all of it, or no such file could be made, which is told.
    std::optional<std::string> file_of(const std::string& picture, PictureSpace space);
    // After a file of this cache could not be read: it is made anew, for this render alone where it was
    // deleted, as by another one that needs room.
    std::optional<std::string> remade(const std::string& picture, PictureSpace space);

    uint64_t made() const { return m_made; }

  private:
    class Working;
    std::optional<std::string> make(const std::string& picture, PictureSpace space, bool to_keep);
    std::string path_of(const std::string& picture, PictureSpace space, const std::string& folder) const;
    std::string own_folder();

    const std::string m_folder;
    const uint64_t m_most_bytes;
    Journal& m_journal;
    std::atomic<uint64_t> m_made{0};

    std::mutex m_mutex; // of what follows
    std::condition_variable m_done;
    uint64_t m_working_bytes = 0; // of pictures that textures are being made of
    std::string m_own_folder;     // where the other cannot be written; empty = none yet
};

std::string texture_cache_folder(); // KANUKA_TEXTURE_CACHE, or the user's cache folder
uint64_t texture_cache_limit();     // bytes; KANUKA_TEXTURE_CACHE_SIZE, as 500M or 20G, or 20 GiB

} // namespace kanuka::shade
