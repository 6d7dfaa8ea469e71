// Folders of stored pages: kanuka.store_packs(), kanuka.store_prune().
#include "store/disk_store.h"

#include <nanobind/stl/filesystem.h>

#include "python/arguments.h"
#include "python/supervisor.h"

namespace kanuka::python {

void bind_store(nb::module_& m) {
    define(
        m, "store_packs",
        [](const std::filesystem::path& folder, bool verify) {
            std::vector<store::PackInfo> packs;
            {
                nb::gil_scoped_release free;
                packs = store::packs_in(folder.string(), verify);
            }
            nb::list list;
            for (const store::PackInfo& pack : packs) {
                nb::dict entry;
                entry["file"] = pack.file;
                entry["kind"] = pack.is_hierarchy ? "hierarchy" : "pages";
                entry["bytes"] = pack.bytes;
                entry["pages"] = pack.pages;
                entry["compressed_pages"] = pack.compressed_pages;
                entry["age_s"] = pack.age_s;
                entry["of_this_build"] = pack.of_this_build;
                entry["problem"] = pack.problem;
                list.append(entry);
            }
            return list;
        },
        nb::arg("folder"), nb::kw_only(), nb::arg("verify") = false,
        nb::sig(
            "def store_packs(folder: str | os.PathLike, *, verify: bool = False) -> list[dict[str, object]]"),
        "What is in a store of diced and shaded geometry, used last first: packs of pages, and files of the "
        "ray tracer's hierarchy, by\ntheir 'kind'. With `verify`, every page is read and 'problem' says what "
        "is wrong with a file.");
    define(
        m, "store_prune",
        [](const std::filesystem::path& folder, uint64_t bytes) {
            return store::trim_store(folder.string(), bytes);
        },
        nb::arg("folder"), nb::arg("bytes"),
        nb::sig("def store_prune(folder: str | os.PathLike, bytes: int) -> int"),
        "Removes the files not used for longest until no more than so many bytes are left; returns the "
        "number of files removed.");
    define(
        m, "store_compress",
        [](const std::filesystem::path& folder, double idle_s, nb::handle progress) {
            if (!progress.is_none() && !PyCallable_Check(progress.ptr()))
                wrong_argument("progress", "a callable or None", progress);
            store::Compression done;
            Supervisor supervisor(progress);
            supervisor.run(
                [&] { done = store::compress_store(folder.string(), idle_s, supervisor.progress()); });
            supervisor.rethrow_interrupt();
            nb::dict result;
            result["packs"] = done.packs;
            result["bytes_before"] = done.bytes_before;
            result["bytes_after"] = done.bytes_after;
            return result;
        },
        nb::arg("folder"), nb::kw_only(), nb::arg("idle_s") = 86400.0, nb::arg("progress") = nb::none(),
        nb::sig("def store_compress(folder: str | os.PathLike, *, idle_s: float = 86400, progress: "
                "Callable[[str, float], object] | None = None) -> dict[str, int]"),
        "Compresses the packs that were not used for so many seconds, to about a third; renders read them as "
        "before. Returns\nhow many packs, and their bytes before and after. Interrupted, what is done "
        "stays.");
}

} // namespace kanuka::python
