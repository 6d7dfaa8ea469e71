// kanuka.merge(): parts of a picture that several hosts have rendered, as one.
#include "render/checkpoint.h"

#include <nanobind/stl/filesystem.h>

#include "python/arguments.h"

namespace kanuka::python {

namespace {

std::pair<int, int> resolution_of(const render::Window& window) {
    return {window.width(), window.height()};
}

render::Checkpoint merge(const std::vector<std::filesystem::path>& files) {
    std::vector<std::string> paths;
    for (const std::filesystem::path& file : files)
        paths.push_back(file.string());
    nb::gil_scoped_release free;
    return render::merge_checkpoints(paths);
}

Picture picture_of(const render::Checkpoint& checkpoint) {
    Picture picture;
    picture.exposure_gain = checkpoint.how.exposure_gain;
    picture.encoding = film::png_encoding(checkpoint.how.display, checkpoint.how.exposure_gamma);
    nb::gil_scoped_release free;
    picture.picture = checkpoint.picture();
    return picture;
}

nb::dict info(const std::filesystem::path& path) {
    const render::CheckpointHead head = render::read_checkpoint_head(path.string());
    nb::dict about;
    about["file"] = path.string();
    about["bytes"] = head.bytes;
    about["key"] = head.key.text();
    about["resolution"] = resolution_of(head.window);
    about["adaptive"] = head.stops;
    about["first"] = head.first;
    about["end"] = head.least;
    about["under_way_to"] = head.most;
    return about;
}

} // namespace

void bind_checkpoint(nb::module_& m) {
    nb::class_<render::Checkpoint> checkpoint(
        m, "Checkpoint",
        "The samples of a picture, or of a part of it, as merge() has read and joined them. It needs no "
        "scene.");
    define(
        checkpoint, "save",
        [](const render::Checkpoint& self, const std::filesystem::path& path) {
            const std::string file = path.string();
            nb::gil_scoped_release free;
            render::save_checkpoint(file, self.key, self.how, self.gathered);
        },
        nb::arg("path"), "Writes it; kanuka.Session.resume() goes on from there.");
    checkpoint
        .def("picture", &picture_of, nb::sig("def picture(self) -> Picture"),
             "The picture, exposed as the scene said when its first part was saved. Raises Error for a part "
             "that "
             "does not\nbegin at progression 0, and for pictures with an imager, which take the scene.")
        .def_prop_ro(
            "key", [](const render::Checkpoint& c) { return c.key.text(); }, nb::sig("def key(self) -> str"),
            "Of the picture: parts of one picture have the same.")
        .def_prop_ro(
            "part",
            [](const render::Checkpoint& c) {
                return std::pair(c.gathered.first(), c.gathered.least_done());
            },
            nb::sig("def part(self) -> tuple[int, int]"),
            "The first progression, and the one after the last that every pixel has.")
        .def_prop_ro(
            "resolution", [](const render::Checkpoint& c) { return resolution_of(c.gathered.window()); },
            nb::sig("def resolution(self) -> tuple[int, int]"), "Of the pixels that are rendered.");
    define(m, "merge", &merge, nb::arg("files"),
           nb::sig("def merge(files: Sequence[str | os.PathLike]) -> Checkpoint"),
           "Joins checkpoints of parts of one picture, in any order: the same bits as one session's that had "
           "made all of their\nprogressions. The last part may be under way. Raises Error if they are of "
           "different pictures, overlap or leave a gap, and\nsays which progressions.");
    define(m, "checkpoint_info", &info, nb::arg("path"),
           nb::sig("def checkpoint_info(path: str | os.PathLike) -> dict[str, object]"),
           "What a checkpoint says of itself, without reading its samples: 'key' of the picture, 'first' and "
           "'end' of the\nprogressions that all pixels have, 'under_way_to' what some have, 'resolution', "
           "'adaptive', 'bytes'.");
}

} // namespace kanuka::python
