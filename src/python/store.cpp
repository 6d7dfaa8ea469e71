// Folders of stored pages: kanuka.store_packs(), kanuka.store_prune().
#include "store/disk_store.h"

#include <nanobind/stl/filesystem.h>

#include "python/arguments.h"

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
                entry["bytes"] = pack.bytes;
                entry["pages"] = pack.pages;
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
        "What is in a store of diced and shaded geometry, used last first; with `verify`, every page is read "
        "and "
        "'problem' says what\nis wrong with a pack.");
    define(
        m, "store_prune",
        [](const std::filesystem::path& folder, uint64_t bytes) {
            return store::trim_store(folder.string(), bytes);
        },
        nb::arg("folder"), nb::arg("bytes"),
        nb::sig("def store_prune(folder: str | os.PathLike, bytes: int) -> int"),
        "Removes the packs not used for longest until no more than so many bytes are left; returns the "
        "number of "
        "files removed.");
}

} // namespace kanuka::python
