// Rendering and loading. The work runs on a thread of its own; the calling thread keeps serving Python: it
// calls the progress function, and notices Ctrl-C.
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <thread>

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include "ingest/rib/convert.h"
#include "ingest/rib/rib.h"
#include "python/bindings.h"
#include "python/procedurals.h"
#include "render/session.h"
#include "transport/integrator.h"

namespace kanuka::python {

namespace {

// Runs `work` on another thread while the caller polls Python. Progress is handed over, one report a phase at
// least.
class Supervisor {
  public:
    explicit Supervisor(nb::handle callback) : m_callback(callback) {}

    Progress progress() {
        Progress p;
        p.update = [this](std::string_view phase, double fraction) {
            std::lock_guard lock(m_mutex);
            if (m_reports.empty() || m_reports.back().first != phase)
                m_reports.emplace_back(phase, fraction);
            else
                m_reports.back().second = fraction;
        };
        p.cancelled = [this] { return m_cancelled.load(); };
        return p;
    }

    // Throws what `work` threw, or what the progress function did. A KeyboardInterrupt cancels; see
    // `interrupted`.
    void run(const std::function<void()>& work) {
        std::thread thread([&] {
            try {
                work();
            } catch (...) {
                m_failure = std::current_exception();
            }
            std::lock_guard lock(m_mutex);
            m_done = true;
            m_wake.notify_one();
        });
        std::exception_ptr python_failure;
        for (bool done = false; !done;) {
            {
                nb::gil_scoped_release free;
                std::unique_lock lock(m_mutex);
                done = m_wake.wait_for(lock, std::chrono::milliseconds(50), [this] { return m_done; });
            }
            try {
                serve();
            } catch (nb::python_error& error) {
                m_cancelled = true;
                if (error.matches(PyExc_KeyboardInterrupt))
                    m_interrupted = true;
                else if (!python_failure)
                    python_failure = std::current_exception();
            }
        }
        {
            nb::gil_scoped_release free;
            thread.join();
        }
        if (python_failure)
            std::rethrow_exception(python_failure);
        if (m_failure)
            std::rethrow_exception(m_failure);
    }

    void rethrow_interrupt() const {
        if (!m_interrupted)
            return;
        PyErr_SetNone(PyExc_KeyboardInterrupt);
        nb::raise_python_error();
    }

  private:
    void serve() {
        if (PyErr_CheckSignals() != 0)
            nb::raise_python_error();
        std::vector<std::pair<std::string, double>> reports;
        {
            std::lock_guard lock(m_mutex);
            reports.swap(m_reports);
        }
        if (!m_callback.is_none() && !m_cancelled)
            for (const auto& [phase, fraction] : reports)
                m_callback(phase, fraction);
    }

    nb::handle m_callback;
    std::mutex m_mutex;
    std::condition_variable m_wake;
    bool m_done = false, m_interrupted = false;
    std::atomic<bool> m_cancelled{false};
    std::vector<std::pair<std::string, double>> m_reports;
    std::exception_ptr m_failure;
};

std::string standard_shaders() {
    return nb::cast<std::string>(nb::module_::import_("kanuka.paths").attr("standard_shaders")());
}

Picture render(std::shared_ptr<Scene> scene, const render::Overrides& given,
               std::optional<bool> strict_directions, nb::handle callback, std::shared_ptr<Journal> journal) {
    render::Overrides overrides = given;
    overrides.standard_shaders = standard_shaders();
    overrides.delayed = scene->delayed.get();
    scene::Scene& s = scene->scene;
    struct Restore { // the scene's own option is the scene's own
        bool& option;
        bool value;
        ~Restore() { option = value; }
    } const restore{s.options.strict_directions, s.options.strict_directions};
    s.options.strict_directions = strict_directions.value_or(s.options.strict_directions);
    const int width = overrides.width.value_or(s.options.width),
              height = overrides.height.value_or(s.options.height);
    if (width < 1 || height < 1)
        throw nb::value_error("resolution: expected two positive numbers");
    s.camera = scene->camera.resolve(s.options, width, height);
    if (!journal) {
        journal = std::make_shared<Journal>();
        for (const Journal::Entry& e : scene->journal->entries())
            for (uint64_t i = 0; i < e.count; i++)
                journal->report(e.severity, e.where, e.message);
    }
    Picture picture;
    picture.journal = journal;
    picture.stats = std::make_shared<Stats>();
    picture.stats->time.ingest_s = picture.stats->time.total_s = scene->ingest_s;
    picture.exposure_gain = s.options.exposure_gain;
    picture.encoding = film::png_encoding(s.options.color.display, s.options.exposure_gamma);

    Supervisor supervisor(callback);
    render::Result result;
    supervisor.run(
        [&] { result = render::render(s, overrides, *journal, *picture.stats, supervisor.progress()); });
    if (result.picture.channels.empty()) // nothing to keep
        supervisor.rethrow_interrupt();
    picture.picture = std::move(result.picture);
    picture.cancelled = result.cancelled;
    return picture;
}

std::shared_ptr<Scene> load(const std::vector<std::string>& paths,
                            const std::vector<std::string>& archive_path, int frame, int repeat,
                            bool run_programs, nb::dict procedurals, bool on_demand, bool run_system) {
    auto scene = std::make_shared<Scene>();
    ingest::RibOptions options;
    options.archive_path = archive_path;
    options.frame = frame;
    options.repeat = repeat;
    options.run_programs = run_programs;
    options.run_system = run_system;
    options.procedural = plug_ins(std::move(procedurals));
    if (on_demand)
        options.on_demand = &scene->delayed;
    Supervisor supervisor{nb::none()};
    supervisor.run([&] {
        ScopedTimer timer(scene->ingest_s);
        scene->scene = ingest::read_ribs(paths, options, *scene->journal);
    });
    supervisor.rethrow_interrupt();
    scene->scene.journal = scene->journal.get();
    scene->camera.camera = scene->scene.camera;
    for (const auto& p : scene->scene.primitives)
        scene->next_id = std::max(scene->next_id, p.id + 1);
    return scene;
}

} // namespace

void bind_render(nb::module_& m) {
    m.def(
        "render",
        [](std::shared_ptr<Scene> scene, std::optional<int> progressions, std::optional<int> threads,
           std::optional<std::pair<int, int>> resolution, std::optional<std::array<float, 4>> crop,
           std::optional<float> shading_rate, std::optional<float> geometry_tolerance,
           std::optional<int> max_depth, std::optional<std::string> integrator, std::optional<uint32_t> seed,
           const std::vector<std::string>& aovs, std::optional<std::array<float, 2>> shutter, int lanes,
           std::optional<bool> strict_directions, nb::handle progress, std::shared_ptr<Journal> journal) {
            render::Overrides o;
            o.progressions = progressions;
            o.threads = threads;
            if (resolution)
                o.width = resolution->first, o.height = resolution->second;
            o.crop = crop;
            o.shading_rate = shading_rate;
            o.geometry_tolerance = geometry_tolerance;
            o.max_depth = max_depth;
            o.integrator = integrator;
            o.seed = seed;
            o.aovs = aovs;
            if (shutter && !((*shutter)[0] <= (*shutter)[1]))
                throw nb::value_error("shutter: it must open before it closes");
            o.shutter = shutter;
            o.lanes = lanes;
            return render(scene, o, strict_directions, progress, journal);
        },
        nb::arg("scene"), nb::kw_only(), nb::arg("progressions") = nb::none(),
        nb::arg("threads") = nb::none(), nb::arg("resolution") = nb::none(), nb::arg("crop") = nb::none(),
        nb::arg("shading_rate") = nb::none(), nb::arg("geometry_tolerance") = nb::none(),
        nb::arg("max_depth") = nb::none(), nb::arg("integrator") = nb::none(), nb::arg("seed") = nb::none(),
        nb::arg("aovs") = nb::list(), nb::arg("shutter") = nb::none(), nb::arg("lanes") = 0,
        nb::arg("strict_directions") = nb::none(), nb::arg("progress") = nb::none(),
        nb::arg("journal") = nb::none(),
        "Renders a scene. Arguments go over the scene's own options; None leaves them.\n\n"
        "`progressions` is the number of paths a pixel, `shading_rate` multiplies every object's "
        "micropolygon area.\n"
        "`aovs` names output parameters of surface shaders that become layers of the picture, beside those "
        "that the\n"
        "scene's displays ask for.\n"
        "`progress(phase, fraction)` is called on the calling thread. Ctrl-C stops early and returns what is "
        "there,\n"
        "with `cancelled` set. `strict_directions` makes errors of what surface shaders do that no material "
        "can do;\n"
        "else it is approximated. The picture is the same, bit for bit, for any number of threads.",
        nb::sig("def render(scene: Scene, *, progressions: int | None = None, threads: int | None = None, "
                "resolution: tuple[int, int] | None = None, crop: tuple[float, float, float, float] | None = "
                "None, "
                "shading_rate: float | None = None, geometry_tolerance: float | None = None, "
                "max_depth: int | None = None, integrator: str | None = None, seed: int | None = None, "
                "aovs: Sequence[str] = (), shutter: tuple[float, float] | None = None, "
                "lanes: int = 0, strict_directions: bool | None = None, "
                "progress: Callable[[str, float], object] | None = None, journal: Journal | None = None) -> "
                "Picture"));
    m.def(
        "load",
        [](const std::filesystem::path& path, const std::vector<std::string>& archive_path, int frame,
           int repeat, bool run_programs, nb::dict procedurals, bool on_demand, bool run_system,
           const std::vector<std::filesystem::path>& before) {
            std::vector<std::string> paths(before.begin(), before.end());
            paths.push_back(path.string());
            return load(paths, archive_path, frame, repeat, run_programs, std::move(procedurals), on_demand,
                        run_system);
        },
        nb::arg("path"), nb::kw_only(), nb::arg("archive_path") = nb::list(), nb::arg("frame") = 0,
        nb::arg("repeat") = 0, nb::arg("run_programs") = true, nb::arg("procedurals") = nb::dict(),
        nb::arg("on_demand") = false, nb::arg("run_system") = false, nb::arg("before") = nb::list(),
        "Reads a RIB file, compressed or not; '-' is standard input. What it could not make sense of is in "
        "the\n"
        "scene's journal. run_programs=False forbids Procedural \"RunProgram\". run_system=True lets\n"
        "System have the shell do whatever the scene says. frame: the number of one, and of several of that "
        "number the\none that `repeat` others come before. procedurals: functions by\n"
        "name, for Procedural \"DynamicLoad\" [\"name\" \"data\"]: called with the size in pixels and the\n"
        "data, they return RIB. on_demand=True leaves procedurals with bounds unread until a ray of a "
        "render\n"
        "meets them. before: files that are read before it, as one stream with it: options, declarations.");
    m.def(
        "frames",
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
    m.def(
        "convert_rib",
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
    m.def(
        "check_integrator", [](const std::string& text) { transport::IntegratorChoice::parse(text); },
        nb::arg("text"), "Raises Error unless `text` names an integrator and its parameters.");
}

} // namespace kanuka::python
