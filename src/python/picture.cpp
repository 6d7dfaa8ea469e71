#include <filesystem>
#include <fstream>
#include <unistd.h>

#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "film/ztest.h"
#include "python/arguments.h"
#include "python/arrays.h"
#include "scene/picture_name.h"

namespace kanuka::python {

namespace {

// A layer is what Python sees: channels that belong together. R G B = "rgb", A = "alpha", N.X N.Y N.Z = "N".
struct Layer {
    std::string name;
    std::vector<const film::Picture::Channel*> channels;
};

std::string layer_of(const std::string& channel) {
    if (channel == "R" || channel == "G" || channel == "B")
        return "rgb";
    if (channel == "A")
        return "alpha";
    return channel.substr(0, channel.rfind('.'));
}

std::vector<Layer> layers(const film::Picture& picture) {
    std::vector<Layer> result;
    for (const auto& channel : picture.channels) {
        const std::string name = layer_of(channel.name);
        auto it = std::find_if(result.begin(), result.end(), [&](const Layer& l) { return l.name == name; });
        if (it == result.end())
            it = result.insert(result.end(), Layer{name, {}});
        it->channels.push_back(&channel);
    }
    // Files keep channels in the order of the alphabet: B G R.
    const auto place = [](const film::Picture::Channel* c) {
        return std::string("RGBAXYZ").find(c->name.back());
    };
    for (Layer& layer : result)
        std::stable_sort(layer.channels.begin(), layer.channels.end(),
                         [&](const auto* a, const auto* b) { return place(a) < place(b); });
    return result;
}

std::vector<std::string> keys(const Picture& p) {
    std::vector<std::string> names;
    for (const Layer& layer : layers(p.picture))
        names.push_back(layer.name);
    return names;
}

nb::object to_numpy(const film::Picture& picture,
                    const std::vector<const film::Picture::Channel*>& channels) {
    const size_t pixels = size_t(picture.width) * size_t(picture.height), count = channels.size();
    auto data = std::make_unique<float[]>(pixels * count);
    for (size_t c = 0; c < count; c++)
        for (size_t i = 0; i < pixels; i++)
            data[i * count + c] = channels[c]->data[i];
    float* raw = data.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<float*>(p); });
    const size_t shape[] = {size_t(picture.height), size_t(picture.width), count};
    nb::ndarray<nb::numpy, float> array(raw, count == 1 ? 2 : 3, shape, owner);
    return array.cast();
}

nb::object get_layer(const Picture& p, const std::string& name) {
    std::string wanted = name == "rgba" ? "rgb" : name;
    for (Layer& layer : layers(p.picture))
        if (layer.name == wanted) {
            if (name == "rgba")
                if (const auto* alpha = p.picture.find("A"))
                    layer.channels.push_back(alpha);
            return to_numpy(p.picture, layer.channels);
        }
    if (const auto* channel = p.picture.find(name))
        return to_numpy(p.picture, {channel});
    std::string there;
    for (const std::string& key : keys(p))
        there += (there.empty() ? "" : ", ") + key;
    throw nb::key_error(("no layer \"" + name + "\"; there are " + there).c_str());
}

void init_picture(Picture* self, const nb::dict& arrays) {
    new (self) Picture();
    film::Picture& picture = self->picture;
    for (auto [key, value] : arrays) {
        const auto name = argument<std::string>(key, "layers: a name");
        const FloatArray array = float_array(value, name.c_str());
        if (array.shape.size() < 2 || array.shape.size() > 3)
            throw nb::value_error(
                (name + ": expected shape (height, width) or (height, width, channels)").c_str());
        const int height = int(array.shape[0]), width = int(array.shape[1]);
        const size_t count = array.shape.size() == 3 ? array.shape[2] : 1;
        if (!picture.channels.empty() && (width != picture.width || height != picture.height))
            throw nb::value_error((name + ": layers differ in size").c_str());
        picture.width = picture.full_width = width;
        picture.height = picture.full_height = height;
        const bool is_rgb = name == "rgb" || name == "rgba";
        const std::string letters = name == "N" || name == "P" ? "XYZ" : "RGBA";
        if (count > letters.size())
            throw nb::value_error((name + ": too many channels").c_str());
        for (size_t c = 0; c < count; c++) {
            film::Picture::Channel channel;
            channel.name = count == 1 ? (name == "alpha" ? "A" : name)
                                      : (is_rgb ? "" : name + ".") + std::string(1, letters[c]);
            channel.half = false;
            for (size_t i = 0; i < size_t(width) * size_t(height); i++)
                channel.data.push_back(array.buffer[i * count + c]);
            picture.channels.push_back(std::move(channel));
        }
    }
    if (picture.channels.empty())
        throw nb::value_error("a picture needs a layer");
}

// The look of the picture: what stands behind a surface, an environment that the camera sees too, has no
// alpha.
film::Picture without_alpha(const film::Picture& picture) {
    film::Picture result = picture;
    std::erase_if(result.channels, [](const auto& channel) { return channel.name == "A"; });
    return result;
}

// Its channels of these layers alone.
Picture with_layers(const Picture& p, const std::vector<std::string>& names) {
    Picture result = p;
    const auto unwanted = [&](const film::Picture::Channel& channel) {
        return std::find(names.begin(), names.end(), layer_of(channel.name)) == names.end();
    };
    std::erase_if(result.picture.channels, unwanted);
    if (result.picture.channels.empty())
        throw nb::value_error("layers: the picture has none of them; keys() names those that it has");
    return result;
}

void write(Picture& p, const std::filesystem::path& path, std::optional<float> gain,
           std::optional<float> gamma, bool alpha, const std::string& display,
           const std::optional<std::vector<std::string>>& layers) {
    if (layers) {
        Picture some = with_layers(p, *layers);
        return write(some, path, gain, gamma, alpha, display, {});
    }
    const std::string suffix = path.extension().string(), file = path.string();
    film::PngEncoding encoding = p.encoding;
    if (!display.empty()) {
        if (display != film::LinearDisplay && !color::find_display(display))
            throw nb::value_error("display: expected \"srgb\", \"rec709\" or \"linear\"");
        encoding = film::png_encoding(display, 1);
    }
    double unused = 0;
    nb::gil_scoped_release free;
    ScopedTimer timer(p.stats ? p.stats->time.film_s : unused);
    if (suffix == ".exr")
        film::write_exr(file, p.picture);
    else if (suffix == ".png")
        film::write_png(file, alpha ? p.picture : without_alpha(p.picture), gain.value_or(p.exposure_gain),
                        gamma.value_or(encoding.gamma), encoding.display);
    else
        throw Error(file + ": pictures are written as .exr or .png", ExitCode::Usage);
}

// The file's bytes: writers have no other way out.
nb::bytes png_of(Picture& p) {
    std::string path = (std::filesystem::temp_directory_path() / "kanuka-XXXXXX.png").string();
    const int handle = mkstemps(path.data(), 4);
    if (handle < 0)
        throw Error(path + ": no temporary file can be made", ExitCode::Output);
    ::close(handle);
    std::string bytes;
    try {
        write(p, path, std::nullopt, std::nullopt, false, "", std::nullopt);
        std::ifstream in(path, std::ios::binary);
        bytes.assign(std::istreambuf_iterator<char>(in), {});
    } catch (...) {
        ::unlink(path.c_str());
        throw;
    }
    ::unlink(path.c_str());
    return nb::bytes(bytes.data(), bytes.size());
}

nb::list fireflies(const Stats& s) {
    nb::list all;
    for (const Stats::Firefly& f : s.fireflies) {
        nb::list path;
        for (const Stats::Firefly::Vertex& v : f.path) {
            nb::dict vertex;
            vertex["object"] = v.object, vertex["lobe"] = v.lobe;
            vertex["smooth"] = v.smooth, vertex["through"] = v.through;
            vertex["distance"] = v.distance;
            vertex["lights_hit"] = v.lights_hit, vertex["emitted"] = v.emitted;
            vertex["light_samples"] = v.light_samples;
            path.append(vertex);
        }
        nb::dict one;
        one["pixel"] = nb::make_tuple(f.x, f.y);
        one["progression"] = f.progression;
        one["luminance"] = f.luminance, one["mean"] = f.mean;
        one["path"] = path;
        all.append(one);
    }
    return all;
}

nb::object stats_dict(const Picture& p) {
    if (!p.stats)
        return nb::none();
    const Stats& s = *p.stats;
    nb::dict time, count, bytes, all;
    time["ingest_s"] = s.time.ingest_s;
    time["dice_s"] = s.time.dice_s;
    time["shade_s"] = s.time.shade_s;
    time["store_s"] = s.time.store_s;
    time["bvh_s"] = s.time.bvh_s;
    time["transport_s"] = s.time.transport_s;
    time["film_s"] = s.time.film_s;
    time["total_s"] = s.time.total_s;
    time["first_pixel_s"] = s.time.first_pixel_s;
    count["primitives"] = s.count.primitives.load();
    count["primitives_kept"] = s.count.primitives_kept.load();
    count["primitives_stored"] = s.count.primitives_stored.load();
    count["grids"] = s.count.grids.load();
    count["vertices"] = s.count.vertices.load();
    count["micropolygons"] = s.count.micropolygons.load();
    count["traced_polygons"] = s.count.traced_polygons.load();
    count["instances"] = s.count.instances.load();
    count["instances_coarser"] = s.count.instances_coarser.load();
    count["instance_levels"] = s.count.instance_levels.load();
    count["level_vertices"] = s.count.level_vertices.load();
    count["shader_evaluations"] = s.count.shader_evaluations.load();
    count["paths"] = s.count.paths.load();
    count["rays"] = s.count.rays.load();
    count["nan_samples"] = s.count.nan_samples.load();
    count["procedurals"] = s.count.procedurals.load();
    count["textures_made"] = s.count.textures_made.load();
    count["procedurals_read"] = s.count.procedurals_read.load();
    count["fireflies"] = s.count.fireflies.load();
    all["fireflies"] = fireflies(s);
    nb::list factors;
    for (const float factor : s.roulette)
        factors.append(factor);
    all["roulette"] = factors;
    nb::list pairs;
    for (const int bounce : s.sky_pairs)
        pairs.append(bounce);
    all["sky_pairs"] = pairs;
    bytes["grids"] = s.bytes.grids;
    bytes["lobe_inputs"] = s.bytes.lobe_inputs;
    bytes["bvh"] = s.bytes.bvh;
    bytes["hierarchy_built"] = s.bytes.hierarchy_built;
    bytes["hierarchy_stored"] = s.bytes.hierarchy_stored;
    bytes["textures"] = s.bytes.textures;
    bytes["store_read"] = s.bytes.store_read;
    bytes["store_written"] = s.bytes.store_written;
    bytes["peak_rss"] = s.bytes.peak_rss;
    bytes["scratch"] = s.bytes.scratch;
    bytes["given_back"] = s.bytes.given_back;
    all["time"] = time;
    all["count"] = count;
    all["bytes"] = bytes;
    return all;
}

void bind_z_test(nb::module_& m) {
    using R = film::ZTestResult;
    nb::class_<R>(m, "ZTestResult", "Whether a noisy picture may have the expectation of a reference.")
        .def_prop_ro("passed", &R::passed)
        .def_ro("tests", &R::tests)
        .def_ro("rejected", &R::rejected)
        .def_ro("level", &R::level, "a value is rejected where its p is below")
        .def_ro("smallest_p", &R::smallest_p)
        .def_prop_ro("worst_at", [](const R& r) { return std::pair(r.worst_x, r.worst_y); })
        .def_prop_ro("p_values", [](const R& r) { return Picture{.picture = r.p_values}; });
    define(
        m, "z_test",
        [](const Picture& reference, const Picture& variance, const Picture& test, double reference_samples,
           double test_samples, double significance) {
            film::ZTestOptions options;
            options.significance = significance;
            options.reference_samples = reference_samples;
            options.test_samples = test_samples;
            nb::gil_scoped_release free;
            return film::z_test(reference.picture, variance.picture, test.picture, nullptr, options);
        },
        nb::arg("reference"), nb::arg("variance"), nb::arg("test"), nb::kw_only(),
        nb::arg("reference_samples"), nb::arg("test_samples"), nb::arg("significance") = 0.01,
        "A Z-test a pixel, with Šidák's correction over all. `variance` is that of the reference's means; "
        "the test\n"
        "picture's is taken to be it, times reference_samples / test_samples.");
}

Picture read(const std::filesystem::path& path) {
    nb::gil_scoped_release free;
    Picture p;
    p.picture = film::read_exr(path.string());
    return p;
}

void bind_comparison(nb::module_& m) {
    using C = film::Comparison;
    nb::class_<C>(m, "Comparison", "How far one picture is from another.")
        .def_ro("relative_mse", &C::relative_mse, "mean of (a - b)² / (b² + 0.01)")
        .def_ro("mean_a", &C::mean_a)
        .def_ro("mean_b", &C::mean_b)
        .def_ro("mean_ratio", &C::mean_ratio)
        .def_ro("max_error", &C::max_error)
        .def_prop_ro(
            "max_at", [](const C& c) { return std::pair(c.max_x, c.max_y); }, "pixel of the largest error")
        .def_ro("flip", &C::flip, "mean LDR-FLIP, 0 to 1")
        .def_ro("nonfinite_a", &C::nonfinite_a, "pixels that hold a NaN or infinity; they are in no mean")
        .def_ro("nonfinite_b", &C::nonfinite_b)
        .def_prop_ro(
            "difference", [](const C& c) { return Picture{.picture = c.difference}; }, "the FLIP map");
    define(
        m, "compare",
        [](const Picture& a, const Picture& b, float gain) {
            nb::gil_scoped_release free;
            return film::compare(a.picture, b.picture, gain);
        },
        nb::arg("a"), nb::arg("b"), nb::kw_only(), nb::arg("gain") = 1.0f,
        "Compares two pictures of one size; b is the reference. FLIP sees both times `gain`.");
}

} // namespace

void bind_journal(nb::module_& m) {
    using Entry = Journal::Entry;
    nb::class_<Entry>(m, "Message", "Something that a render survived.")
        .def_prop_ro("severity",
                     [](const Entry& e) {
                         return e.severity == Severity::Error     ? "error"
                                : e.severity == Severity::Warning ? "warning"
                                                                  : "info";
                     })
        .def_prop_ro("file", [](const Entry& e) { return e.where.file.str(); })
        .def_prop_ro("line", [](const Entry& e) { return e.where.line; })
        .def_prop_ro("column", [](const Entry& e) { return e.where.column; })
        .def_ro("message", &Entry::message)
        .def_ro("count", &Entry::count)
        .def("__str__", [](const Entry& e) {
            const std::string at = e.where.str();
            return (at.empty() ? "" : at + ": ") + e.message;
        });
    nb::class_<Journal> journal(m, "Journal",
                                "What went wrong without stopping: the same message at the same place once.");
    define(
        journal, "add",
        [](Journal& j, const std::string& severity, const std::string& message, const std::string& file) {
            static const std::map<std::string, Severity> Severities{
                {"info", Severity::Info}, {"warning", Severity::Warning}, {"error", Severity::Error}};
            const auto found = Severities.find(severity);
            if (found == Severities.end())
                throw nb::value_error(
                    ("severity: \"" + severity + "\" is not one of \"info\", \"warning\", \"error\"")
                        .c_str());
            j.report(found->second, Location{file}, message);
        },
        nb::arg("severity"), nb::arg("message"), nb::arg("file") = "",
        "Adds a message: \"info\", \"warning\" or \"error\".");
    journal.def(nb::init<>())
        .def("__len__", [](const Journal& j) { return j.entries().size(); })
        .def_prop_ro("messages", &Journal::entries)
        .def_prop_ro("error_count", &Journal::error_count)
        .def(
            "__iter__", [](const Journal& j) { return nb::iter(nb::cast(j.entries())); },
            nb::sig("def __iter__(self) -> Iterator[Message]"));
}

static void bind_class(nb::module_& m) {
    nb::class_<Picture> picture(
        m, "Picture",
        "Pixels by layer: picture['rgb'] is a (height, width, 3) array of scene-linear Rec.709, others\n"
        "are 'alpha', 'albedo', 'N', 'Z', … as picture.keys() says; rows run from the top.");
    define(picture, "__init__", &init_picture, nb::arg("layers"),
           "A picture from arrays: Picture({'rgb': array}).",
           nb::sig("def __init__(self, layers: dict[str, ArrayLike]) -> None"));
    define(picture, "__getitem__", &get_layer, nb::arg("layer"),
           nb::sig("def __getitem__(self, layer: str) -> numpy.typing.NDArray[numpy.float32]"));
    picture.def("__contains__", [](const Picture& p, const std::string& name) {
        const auto names = keys(p);
        return std::find(names.begin(), names.end(), name) != names.end();
    });
    picture.def("keys", &keys);
    picture.def(
        "__iter__", [](const Picture& p) { return nb::iter(nb::cast(keys(p))); },
        nb::sig("def __iter__(self) -> Iterator[str]"));
    picture.def("__len__", [](const Picture& p) { return keys(p).size(); });
    picture.def_prop_ro("width", [](const Picture& p) { return p.picture.width; });
    picture.def_prop_ro("height", [](const Picture& p) { return p.picture.height; });
    picture.def_prop_ro(
        "full_size", [](const Picture& p) { return std::pair(p.picture.full_width, p.picture.full_height); },
        "of the whole frame; a cropped picture is smaller");
    picture.def_prop_ro(
        "offset", [](const Picture& p) { return std::pair(p.picture.x0, p.picture.y0); },
        "where the picture sits in the whole frame");
    property(
        picture, "metadata", [](const Picture& p) { return p.picture.metadata; },
        [](Picture& p, const std::map<std::string, std::string>& metadata) {
            p.picture.metadata = metadata;
        });
    picture.def_prop_ro("stats", &stats_dict, "Figures of the render; None for a picture that was read.",
                        nb::sig("def stats(self) -> dict[str, dict[str, float]] | None"));
    picture.def_prop_ro(
        "space", [](const Picture& p) { return std::string(color::info(p.picture.space).name); },
        "colour space of the pixels");
    picture.def_ro("journal", &Picture::journal);
    picture.def_ro("cancelled", &Picture::cancelled,
                   "True where rendering stopped early; the pixels are what was there.");
    define(picture, "write", &write, nb::arg("path"), nb::kw_only(), nb::arg("gain") = nb::none(),
           nb::arg("gamma") = nb::none(), nb::arg("alpha") = false, nb::arg("display") = "",
           nb::arg("layers") = nb::none(),
           "Writes .exr (linear, all layers or those of `layers`) or .png (8 bits, Rec.709 primaries, "
           "what is transparent over black unless\n"
           "`alpha` is set; `gain` defaults to the scene's Exposure. `display`: srgb, rec709 (BT.1886), or "
           "linear: the\n"
           "values as they are. By default it is the scene's, where a gamma of Exposure takes the place of "
           "sRGB;\n"
           "`gamma` comes before it). The file appears complete or not at all.");
    picture.def("_repr_png_", &png_of, "How notebooks show it: a PNG, as write() makes it.");
    picture.def("__repr__", [](const Picture& p) {
        return "<kanuka.Picture " + std::to_string(p.picture.width) + " x " +
               std::to_string(p.picture.height) + ">";
    });
}

static void bind_files(nb::module_& m) {
    define(
        m, "picture_file", [](const std::string& name) { return scene::picture_file(name); },
        nb::arg("display"),
        "The file that the name of a Display stands for: 'ball.tif' is ball.exr, 'anim.0001' anim.0001.exr.");
    define(m, "read", &read, nb::arg("path"), "Reads an EXR file.");
}

void bind_picture(nb::module_& m) {
    bind_class(m);
    bind_files(m);
    bind_comparison(m);
    bind_z_test(m);
}

} // namespace kanuka::python
