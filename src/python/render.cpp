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
#include "python/keywords.h"
#include "python/messages.h"
#include "python/parameters.h"
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

    // The same; then the messages are told, however it ended.
    void run(const std::function<void()>& work, const Messages& messages) {
        try {
            run(work);
        } catch (...) {
            messages.tell();
            throw;
        }
        messages.tell();
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

// ---- render(): the one declaration of its arguments
// --------------------------------------------------------

struct Request {
    render::Overrides overrides;
    nb::object progress = nb::none();
    std::shared_ptr<Journal> journal;
};

// To a member of the overrides; None leaves the scene's.
template <auto Member>
void over(Request& r, nb::handle value, const char* name) {
    r.overrides.*Member = argument<std::remove_cvref_t<decltype(r.overrides.*Member)>>(value, name);
}

using O = render::Overrides;
// Of an option, over the scene's; None leaves that.
void over_option(Request& r, nb::handle value, const char* name) {
    const scene::OptionParameter* row =
        scene::find_option(name == std::string_view("progressions") ? "samples" : name);
    if (!value.is_none())
        r.overrides.options.set(row->name, setting(*row, value, name));
}

constexpr Keyword<Request> OwnKeywords[] = {
    {"progressions", "int | None", "None", "paths a pixel", "None = the scene's samples, else 64",
     over_option},
    {"threads", "int | None", "None", "", "None = all there are; the picture is the same for any number",
     over<&O::threads>},
    {"shading_rate", "float | None", "None", "", "multiplies every object's micropolygon area",
     over<&O::shading_rate>},
    {"aovs", "Sequence[str]", "()", "",
     "output parameters of surface shaders that become layers, beside those that the scene's displays name",
     over<&O::aovs>},
    {"lanes", "int", "0", "1, 8 or 16", "SIMD lanes; 0 = the widest. The picture is the same",
     over<&O::lanes>},
    {"progress", "Callable[[str, float], object] | None", "None", "",
     "called with the phase and its fraction, on the calling thread",
     [](Request& r, nb::handle value, const char* name) {
         if (!value.is_none() && !PyCallable_Check(value.ptr()))
             wrong_argument(name, "a callable or None", value);
         r.progress = nb::borrow(value);
     }},
    {"journal", "Journal | None", "None", "", "takes the messages, which are warnings else",
     [](Request& r, nb::handle value, const char* name) {
         r.journal = argument<std::shared_ptr<Journal>>(value, name, true);
     }},
};

// The call's own, then every option of a scene.
std::span<const Keyword<Request>> render_keywords() {
    static std::vector<std::string> types; // nothing moves once it is filled
    static const std::vector<Keyword<Request>> all = [] {
        const auto options = scene::option_parameters();
        types.reserve(options.size());
        std::vector<Keyword<Request>> table(std::begin(OwnKeywords), std::end(OwnKeywords));
        for (const scene::OptionParameter& row : options) {
            if (row.name == std::string_view("samples")) // progressions
                continue;
            types.push_back(annotation(row, false) + " | None");
            table.push_back({row.name, types.back().c_str(), "None", row.unit, row.about, over_option});
        }
        return table;
    }();
    return all;
}

Picture render(std::shared_ptr<Scene> scene, const nb::kwargs& keywords) {
    Request request;
    take_keywords(request, render_keywords(), "render", keywords);
    render::Overrides& overrides = request.overrides;
    const scene::Scene& s = scene->scene;
    overrides.standard_shaders = standard_shaders();
    overrides.delayed = scene->delayed.get();
    check_idle(*scene);
    struct Reading {
        bool& now;
        explicit Reading(bool& flag) : now(flag) { now = true; }
        ~Reading() { now = false; }
    } const reading(scene->is_rendered);
    scene->scene.options = scene->options; // Python may write its own while the picture is made
    scene::Options options = scene->options;
    overrides.options.apply(options);
    overrides.camera = scene->camera.resolve(options, options.width, options.height);
    const Messages messages(request.journal);
    const std::shared_ptr<Journal> journal = messages.journal;
    Picture picture;
    picture.journal = journal;
    picture.stats = std::make_shared<Stats>();
    picture.stats->time.ingest_s = picture.stats->time.total_s = scene->ingest_s;
    picture.exposure_gain = options.exposure_gain;
    picture.encoding = film::png_encoding(options.color.display, options.exposure_gamma);

    Supervisor supervisor(request.progress);
    render::Result result;
    supervisor.run(
        [&] { result = render::render(s, overrides, *journal, *picture.stats, supervisor.progress()); },
        messages);
    if (messages.tells)
        for (const Journal::Entry& e : scene->journal->entries()) // what reading the scene reported
            for (uint64_t i = 0; i < e.count; i++)
                journal->report(e.severity, e.where, e.message);
    if (result.picture.channels.empty()) // nothing to keep
        supervisor.rethrow_interrupt();
    picture.picture = std::move(result.picture);
    picture.cancelled = result.cancelled;
    char seconds[32];
    std::snprintf(seconds, sizeof seconds, "%.2f", picture.stats->time.total_s);
    log(std::to_string(picture.picture.width) + " × " + std::to_string(picture.picture.height) +
        " pixels in " + seconds + " s");
    return picture;
}

std::shared_ptr<Scene> load(const std::vector<std::string>& paths,
                            const std::vector<std::string>& archive_path, int frame, int repeat,
                            bool run_programs, nb::dict procedurals, bool on_demand, bool run_system,
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
    for (const auto& p : scene->scene.primitives)
        scene->next_id = std::max(scene->next_id, p.id + 1);
    return scene;
}

} // namespace

void bind_render(nb::module_& m) {
    static const std::string // nanobind keeps the pointers
        sig = "def render(scene: Scene, *" + keyword_signature(render_keywords()) + ") -> Picture",
        about = "Renders a scene. Arguments go over the scene's own options; None leaves them.\n" +
                keyword_doc(render_keywords()) +
                "\n\nCtrl-C stops early and returns what is there, with `cancelled` set. What is missing or "
                "replaced "
                "is a kanuka.Warning,\nand in the picture's journal.";
    define(m, "render", &render, nb::arg("scene"), nb::arg("keywords"), nb::sig(sig.c_str()), about.c_str());
    define(
        m, "load",
        [](const std::filesystem::path& path, const std::vector<std::string>& archive_path, int frame,
           int repeat, bool run_programs, nb::dict procedurals, bool on_demand, bool run_system,
           const std::vector<std::filesystem::path>& before, std::shared_ptr<Journal> journal) {
            std::vector<std::string> paths(before.begin(), before.end());
            paths.push_back(path.string());
            return load(paths, archive_path, frame, repeat, run_programs, std::move(procedurals), on_demand,
                        run_system, std::move(journal));
        },
        nb::arg("path"), nb::kw_only(), nb::arg("archive_path") = nb::list(), nb::arg("frame") = 0,
        nb::arg("repeat") = 0, nb::arg("run_programs") = true, nb::arg("procedurals") = nb::dict(),
        nb::arg("on_demand") = false, nb::arg("run_system") = false, nb::arg("before") = nb::list(),
        nb::arg("journal") = nb::none(),
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
        "journal: takes the messages, which are warnings else.");
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

} // namespace kanuka::python
