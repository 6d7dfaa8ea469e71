// Textures and the folder of those made of plain pictures: kanuka.make_texture(),
// kanuka.texture_cache_files().
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "python/arguments.h"
#include "python/bindings.h"
#include "shade/make_texture.h"
#include "shade/texture_cache.h"

namespace kanuka::python {

static void make_texture(const std::vector<std::string>& pictures, const std::string& texture,
                         const std::pair<std::string, std::string>& wrap, const std::string& filter,
                         bool latlong, float fov, const std::pair<float, float>& width) {
    using Kind = shade::TextureMaking::Kind;
    const nb::gil_scoped_release release;
    shade::make_texture({pictures.size() == 6 ? Kind::CubeFaces
                         : latlong            ? Kind::LatLong
                                              : Kind::Texture,
                         pictures, texture, wrap.first, wrap.second, filter, fov, width.first, width.second});
}

static std::string folder_or_default(const std::optional<std::filesystem::path>& folder) {
    return folder && !folder->empty() ? folder->string() : shade::texture_cache_folder();
}

static nb::list cache_files(const std::optional<std::filesystem::path>& folder) {
    nb::list list;
    const auto now = std::filesystem::file_time_type::clock::now();
    std::vector<CachedFile> files = cached_files(folder_or_default(folder), shade::TextureFiles.suffix);
    std::ranges::reverse(files);
    for (const CachedFile& file : files) {
        nb::dict entry;
        entry["file"] = file.path.string();
        entry["bytes"] = file.bytes;
        entry["age_s"] = std::chrono::duration<double>(now - file.used).count();
        list.append(entry);
    }
    return list;
}

void bind_texture(nb::module_& m) {
    define(
        m, "make_texture", &make_texture, nb::arg("pictures"), nb::arg("texture"), nb::kw_only(),
        nb::arg("wrap") = std::pair<std::string, std::string>("periodic", "periodic"),
        nb::arg("filter") = "box", nb::arg("latlong") = false, nb::arg("fov") = 90.0f,
        nb::arg("filter_width") = std::pair<float, float>(0.0f, 0.0f),
        "Makes a tiled, mip-mapped texture of a picture; of six, cube faces in the order px nx py ny pz nz, "
        "a "
        "latitude-longitude environment. `wrap`: along s and t, black, clamp, periodic or mirror. `filter`: "
        "from a level to the next: box, triangle, gaussian, catmull-rom, mitchell, lanczos, bessel and "
        "others, "
        "`filter_width` texels of the smaller level wide along s and t; 0 is the filter's own width. "
        "`latlong`: the picture is an environment by latitude and longitude.");
    define(m, "texture_cache_folder", &shade::texture_cache_folder,
           "Where textures that renders make of plain pictures are kept: KANUKA_TEXTURE_CACHE, or the user's "
           "cache "
           "folder.");
    define(m, "texture_cache_limit", &shade::texture_cache_limit,
           "Its largest size in bytes: KANUKA_TEXTURE_CACHE_SIZE, or 20 GiB.");
    define(
        m, "texture_cache_files", &cache_files, nb::arg("folder") = nb::none(),
        "What is in the texture cache, used last first: file, bytes, age_s (since it was used).",
        nb::sig(
            "def texture_cache_files(folder: str | os.PathLike | None = None) -> list[dict[str, object]]"));
    define(
        m, "texture_cache_prune",
        [](const std::optional<std::filesystem::path>& folder, std::optional<uint64_t> bytes) {
            return trim_cache(folder_or_default(folder), shade::TextureFiles,
                              bytes.value_or(shade::texture_cache_limit()));
        },
        nb::arg("folder") = nb::none(), nb::arg("bytes") = nb::none(),
        "Deletes the files not used for longest until no more than so many bytes are left (None: its limit; "
        "0: all "
        "go); returns how many.",
        nb::sig("def texture_cache_prune(folder: str | os.PathLike | None = None, bytes: int | None = None) "
                "-> int"));
}

} // namespace kanuka::python
