// Reading scenes, and what there is to render them with.
#include <filesystem>

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "ingest/rib/convert.h"
#include "ingest/rib/rib.h"
#include "python/keywords.h"
#include "python/parameters.h"
#include "python/procedurals.h"
#include "python/supervisor.h"
#include "transport/integrator.h"

namespace kanuka::python {

namespace {

std::shared_ptr<Scene> load(const std::vector<std::string>& paths,
                            const std::vector<std::string>& archive_path, int frame, int repeat,
                            bool run_programs, nb::dict procedurals, bool on_demand, bool run_system,
                            std::shared_ptr<ingest::Expansions> expansions,
                            std::shared_ptr<Journal> journal) {
    auto scene = std::make_shared<Scene>();
    const Messages messages(std::move(journal));
    scene->journal = messages.journal;
    ingest::RibOptions options;
    options.archive_path = archive_path;
    options.frame = frame;
    options.repeat = repeat;
    options.run_programs = run_programs;
    options.run_system = run_system;
    options.procedural = plug_ins(std::move(procedurals));
    if (on_demand)
        options.on_demand = &scene->delayed;
    if (expansions)
        options.expansions = scene->expansions =
            std::make_shared<ingest::Expansions::Frame>(std::move(expansions));
    Supervisor supervisor{nb::none()};
    supervisor.run(
        [&] {
            ScopedTimer timer(scene->ingest_s);
            scene->scene = ingest::read_ribs(paths, options, *scene->journal);
        },
        messages);
    supervisor.rethrow_interrupt();
    scene->scene.journal = scene->journal.get();
    scene->camera.camera = scene->scene.camera;
    scene->options = scene->scene.options;
    scene->begin_editing();
    const auto take = [&](int id) { scene->next_id = std::max(scene->next_id, id + 1); };
    const auto take_all = [&](const auto& of) { // the world, or a group
        for (const auto& p : of.primitives)
            take(p.id);
        for (const auto& in : of.instances)
            take(in.first_id + int(in.count()) - 1);
    };
    take_all(scene->scene);
    for (const scene::Group& group : scene->scene.groups)
        take_all(group);
    return scene;
}

void bind_reading(nb::module_& m) {
    define(
        m, "load",
        [](const std::filesystem::path& path, const std::vector<std::string>& archive_path, int frame,
           int repeat, bool run_programs, nb::dict procedurals, bool on_demand, bool run_system,
           const std::vector<std::filesystem::path>& before, std::shared_ptr<ingest::Expansions> expansions,
           std::shared_ptr<Journal> journal) {
            std::vector<std::string> paths(before.begin(), before.end());
            paths.push_back(path.string());
            return load(paths, archive_path, frame, repeat, run_programs, std::move(procedurals), on_demand,
                        run_system, std::move(expansions), std::move(journal));
        },
        nb::arg("path"), nb::kw_only(), nb::arg("archive_path") = nb::list(), nb::arg("frame") = 0,
        nb::arg("repeat") = 0, nb::arg("run_programs") = true, nb::arg("procedurals") = nb::dict(),
        nb::arg("on_demand") = false, nb::arg("run_system") = false, nb::arg("before") = nb::list(),
        nb::arg("expansions") = nb::none(), nb::arg("journal") = nb::none(),
        "Reads a RIB file, compressed or not; '-' is standard input. What it could not make sense of is a "
        "kanuka.Warning,\n"
        "and in the scene's journal. run_programs=False forbids Procedural \"RunProgram\". run_system=True "
        "lets\n"
        "System have the shell do whatever the scene says. frame: the number of one, and of several of that "
        "number the\none that `repeat` others come before. procedurals: functions by\n"
        "name, for Procedural \"DynamicLoad\" [\"name\" \"data\"]: called with the size in pixels and the\n"
        "data, they return RIB. on_demand=True leaves procedurals with bounds unread until a ray of a "
        "render\n"
        "meets them. before: files that are read before it, as one stream with it: options, declarations.\n"
        "expansions: what programs and plug-ins have made for other frames of the shot, and will make for "
        "this one.\n"
        "journal: takes the messages, which are warnings else.");
    define(
        m, "load_camera",
        [](const std::filesystem::path& path, int frame, int repeat,
           const std::vector<std::filesystem::path>& before) {
            std::vector<std::string> paths(before.begin(), before.end());
            paths.push_back(path.string());
            ingest::RibOptions options;
            options.frame = frame;
            options.repeat = repeat;
            options.run_programs = false;
            Camera camera;
            Supervisor supervisor{nb::none()};
            supervisor.run([&] { camera.camera = ingest::read_camera(paths, options); });
            supervisor.rethrow_interrupt();
            return camera;
        },
        nb::arg("path"), nb::kw_only(), nb::arg("frame") = 0, nb::arg("repeat") = 0,
        nb::arg("before") = nb::list(),
        "The camera of the scene that load() reads: nothing is read but what stands before its world.",
        nb::sig("def load_camera(path: str | os.PathLike, *, frame: int = 0, repeat: int = 0, "
                "before: Sequence[str | os.PathLike] = ()) -> Camera"));
}

void bind_expansions(nb::module_& m) {
    nb::class_<ingest::Expansions> expansions(
        m, "Expansions",
        "What programs and plug-ins have made of procedurals, for load(expansions=) of all frames of a shot: "
        "what is asked\n"
        "alike is made once. A procedural is as detailed as the nearest of the cameras asks for.");
    define(
        expansions, "__init__",
        [](ingest::Expansions* self, const std::vector<Camera>& shot, double memory) {
            if (!(memory >= 0) || memory > 1e12)
                throw nb::value_error("Expansions: memory must be 0 or more megabytes");
            std::vector<scene::Camera> cameras;
            for (const Camera& camera : shot)
                cameras.push_back(camera.camera);
            new (self) ingest::Expansions(std::move(cameras), uint64_t(memory * (1 << 20)));
        },
        nb::arg("shot"), nb::kw_only(), nb::arg("memory") = 1024.0,
        nb::sig("def __init__(self, shot: Sequence[Camera], *, memory: float = 1024) -> None"),
        "memory: megabytes of their RIB that are kept at most.");
}

void bind_frames(nb::module_& m) {
    define(
        m, "frames",
        [](const std::filesystem::path& path, const std::vector<std::string>& archive_path,
           const std::vector<std::filesystem::path>& before) {
            std::vector<std::string> paths(before.begin(), before.end());
            paths.push_back(path.string());
            ingest::RibOptions options;
            options.archive_path = archive_path;
            std::vector<ingest::RibFrame> frames;
            Supervisor supervisor{nb::none()};
            supervisor.run([&] { frames = ingest::read_frames(paths, options); });
            supervisor.rethrow_interrupt();
            nb::list out;
            for (const ingest::RibFrame& f : frames) {
                nb::dict one;
                one["number"] = f.number;
                one["line"] = f.where.line;
                one["picture"] = f.picture;
                one["source"] = f.source;
                one["repeat"] = f.repeat;
                out.append(one);
            }
            return out;
        },
        nb::arg("path"), nb::kw_only(), nb::arg("archive_path") = nb::list(), nb::arg("before") = nb::list(),
        "The frames of a RIB file, in order: what load(frame=number, repeat=repeat) may ask for (repeat: how "
        "many "
        "frames of\nthat number come before it), the line of its world, whether it makes a picture (else "
        "only what "
        "shadow maps or\ntextures are made of), and whether it is the source of a texture. Worlds outside of "
        "frames "
        "count from 1.",
        nb::sig("def frames(path: str | os.PathLike, *, archive_path: Sequence[str] = (), "
                "before: Sequence[str | os.PathLike] = ()) -> list[dict[str, int | bool]]"));
}

void bind_conversion(nb::module_& m) {
    define(
        m, "convert_rib",
        [](const std::string& source, const std::string& target, bool binary, const std::string& packing,
           bool expand_archives, const std::vector<std::string>& archive_path) {
            ingest::ConvertOptions options{binary, ingest::packing_by_name(target), expand_archives,
                                           archive_path};
            if (packing == "gzip")
                options.packing = ingest::Packing::Gzip;
            else if (packing == "zstd")
                options.packing = ingest::Packing::Zstd;
            else if (packing == "none")
                options.packing = ingest::Packing::None;
            else if (packing != "auto")
                throw nb::value_error("packing: expected auto, none, gzip or zstd");
            auto journal = std::make_shared<Journal>();
            Supervisor supervisor{nb::none()};
            supervisor.run([&] { ingest::convert_rib(source, target, options, *journal); });
            supervisor.rethrow_interrupt();
            return journal;
        },
        nb::arg("source"), nb::arg("target"), nb::kw_only(), nb::arg("binary") = false,
        nb::arg("packing") = "auto", nb::arg("expand_archives") = false, nb::arg("archive_path") = nb::list(),
        "Writes a RIB as canonical text or binary; packing 'auto' goes by the target's name (.gz, .zst). '-' "
        "is\nstandard input and output. What could not be read is in the journal that comes back.");
}

void bind_integrators(nb::module_& m) {
    m.def(
        "integrators",
        [] {
            nb::dict all;
            for (const transport::NamedIntegrator& i : transport::integrators()) {
                nb::dict parameters;
                for (const transport::IntegratorParameter& p : i.info->parameters)
                    if (!p.name.empty())
                        parameters[nb::str(p.name.data(), p.name.size())] =
                            nb::make_tuple(p.fallback, nb::str(p.help.data(), p.help.size()));
                nb::dict one;
                one["help"] = nb::str(i.info->help.data(), i.info->help.size());
                one["parameters"] = parameters;
                all[nb::str(i.name.data(), i.name.size())] = one;
            }
            return all;
        },
        nb::sig("def integrators() -> dict[str, dict]"),
        "What `integrator` takes, by name: 'help', and 'parameters' (name: (default, help)). They are "
        "written\n"
        "as in 'ao:distance=2'.");
    define(
        m, "check_integrator", [](const std::string& text) { transport::IntegratorChoice::parse(text); },
        nb::arg("text"), "Raises Error unless `text` names an integrator and its parameters.");
}

} // namespace

nb::dict shared_of(const Scene& scene) {
    nb::dict found;
    if (!scene.expansions)
        return found;
    const auto counts = scene.expansions->counts();
    found["asked"] = counts.asked;
    found["kept"] = counts.kept;
    found["ahead"] = scene.delayed ? scene.delayed->ahead_count() : 0;
    nb::list again;
    for (const auto& reason : scene.expansions->reasons()) {
        nb::dict each;
        each["why"] = reason.why;
        each["procedurals"] = reason.procedurals;
        each["name"] = reason.name;
        again.append(each);
    }
    found["again"] = again;
    return found;
}

void bind_load(nb::module_& m) {
    bind_expansions(m);
    bind_reading(m);
    bind_frames(m);
    bind_conversion(m);
    bind_integrators(m);
}

} // namespace kanuka::python
