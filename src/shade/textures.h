// Texture lookups: one bounded cache for a render, mip-mapped and filtered. OpenImageIO stays behind this
// file.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/digest.h"
#include "base/error.h"
#include "color/spaces.h"
#include "shade/picture_space.h"
#include "shade/texture_cache.h"
#include "sl/sl.h"

namespace kanuka::shade {

// Files of any format that OpenImageIO reads serve: of large plain pictures tiled textures are made
// (texture_cache.h), small ones are cut to tiles and mip-mapped as they are read. What the colours of a file
// mean is in linear_input.h. t = 0 is the picture's top row, as RISpec has it. Thread safety: all members may
// be called from any thread.
class Textures {
  public:
    Textures(std::vector<std::string> folders, size_t bytes, Journal& journal);
    ~Textures();

    // A file that is missing or broken is reported for `asker` and reads as mid-grey. Names may stand for
    // tiles: udim.h.
    void lookup(const sl::TextureRequest& request, const Location& asker);
    // Latitude-longitude pictures, as base/latlong.h has them.
    void lookup_environment(const sl::TextureRequest& request, const float* x, const float* y, const float* z,
                            const Location& asker);

    // Pictures of 8 and 16 bits, which are sRGB's, are brought to another space; all others are in it
    // already. Before the first lookup.
    void set_space(color::Space space);

    // Files that names stand for before they are looked for. Before the first lookup.
    void set_made(std::map<std::string, std::string> made) { m_made = std::move(made); }
    std::string find(const std::string& name) const; // the file it stands for; empty = none
    // Of that file's size and time of change (of all tiles' files): a texture painted anew is another one.
    Digest identity(const std::string& name) const;
    struct Info {
        int width = 0, height = 0, channels = 0;
        bool environment = false;
    };
    std::optional<Info> info(const char* name); // none = there is no such file, or it is broken
    const std::vector<std::string>& folders() const { return m_folders; }
    uint64_t bytes() const; // memory that tiles take now
    uint64_t made() const { return m_tiled.made(); }

  private:
    struct Entry;
    struct Cache;
    void lookup_tiles(const sl::TextureRequest& request, const Location& asker);
    Entry& entry(const char* name, PictureSpace space);
    void open(Entry& entry, const std::string& name, PictureSpace space);
    bool reopen(Entry& entry, const void* broken);

    std::vector<std::string> m_folders;
    std::map<std::string, std::string> m_made;
    Journal& m_journal;
    TextureCache m_tiled;
    std::unique_ptr<Cache> m_cache;
    bool m_converts = false;
    color::Matrix3 m_space_from_rec709{};
};

} // namespace kanuka::shade
