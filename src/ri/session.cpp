#include "ri/session.h"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <functional>
#include <unistd.h>

#include "film/film.h"
#include "ingest/rib/handlers.h"
#include "render/session.h"
#include "ri/plug_in.h"
#include "scene/picture_name.h"
#include "shade/make_texture.h"
#include "shade/search.h"

namespace kanuka::ri {

namespace fs = std::filesystem;

// ---- start and end ----------------------------------------------------------------------------------

static void heard(const Journal::Entry& e, void* user) {
    const RtInt severity = e.severity == Severity::Error     ? RIE_ERROR
                           : e.severity == Severity::Warning ? RIE_WARNING
                                                             : RIE_INFO;
    const std::string where = e.where.file == "(program)" ? "" : e.where.str() + ": ";
    static_cast<Session*>(user)->hear(severity == RIE_INFO ? RIE_NOERROR : RIE_CONSISTENCY, severity,
                                      where + e.message);
}

static bool is_rib(const std::string& name) {
    return name.ends_with(".rib") || name.ends_with(".rib.gz") || name.ends_with(".rib.zst");
}

// A file for what a program will read: it exists, and is nobody else's.
static std::string file_between() {
    std::string name = (fs::temp_directory_path() / "kanuka-XXXXXX").string();
    const int file = mkstemp(name.data());
    if (file < 0)
        throw Error("RiBegin: no file can be made in " + fs::temp_directory_path().string(),
                    ExitCode::Output);
    ::close(file);
    return name;
}

Session::Session(const std::string& name, const Form& form)
    : m_name(name), m_source(ingest::Source::from_text("", "")) {
    if (name.starts_with('|')) {
        m_command = name.substr(1);
        m_name = file_between();
    }
    if (is_rib(name) || !m_command.empty()) {
        m_output = ingest::open_output(m_name, form.packing.value_or(ingest::packing_by_name(m_name)));
        m_writer = std::make_unique<ingest::Writer>(*m_output, form.binary ? ingest::Writer::Form::Binary
                                                                           : ingest::Writer::Form::Ascii);
        m_writer->comment("##RenderMan RIB-Structure 1.1");
    } else {
        m_journal.set_listener(heard, this);
    }
    ingest::RibOptions options;
    options.procedural = expand_by_library;
    m_reader = std::make_unique<ingest::Reader>(m_journal, ingest::FrameChoice{}, options, *m_source);
    m_reader->context().of_program = true;
}

Session::Session(Recording& recording)
    : next_handle(1 << 30), m_recording(&recording), m_source(ingest::Source::from_text("", "")) {
    m_output = ingest::output_to(recording.text);
    m_writer = std::make_unique<ingest::Writer>(*m_output, ingest::Writer::Form::Ascii);
    m_reader =
        std::make_unique<ingest::Reader>(m_journal, ingest::FrameChoice{}, ingest::RibOptions{}, *m_source);
    m_reader->context().of_program = true;
    ingest::Call world;
    world.spec = ingest::find_request("WorldBegin");
    world.where = where();
    m_reader->call(world);
}

void Session::say_what_it_does() {
    if (!m_writer && !m_name.empty())
        report(RIE_NOERROR, RIE_INFO,
               "RiBegin \"" + m_name +
                   "\" renders; RIB is written to names that end in .rib, .rib.gz or .rib.zst");
}

void Session::finish() {
    if (m_ended)
        return;
    m_ended = true;
    m_reader->stop(); // an archive whose callback ended the context
    if (m_writer) {
        m_writer->flush();
        m_output->finish();
        if (m_command.empty())
            return;
        const int status = std::system(("( " + m_command + "\n) < '" + m_name + "'").c_str());
        std::error_code ignored;
        fs::remove(m_name, ignored);
        if (status != 0)
            report(RIE_SYSTEM, RIE_ERROR, "RiEnd: \"" + m_command + "\" could not run or failed");
        return;
    }
    if (!context().blocks().empty()) {
        report(RIE_NESTING, RIE_ERROR,
               std::string(begin_name(context().blocks().back().kind)) +
                   " is not closed at RiEnd: an unfinished world is not rendered");
        return;
    }
    const bool textures = m_textures_left;
    make_left_textures();
    if (m_pictures == 0 && !textures)
        report(RIE_NOERROR, RIE_INFO, "RiEnd: there was no world to render");
    tell_heard();
}

void Session::abandon() {
    if (m_ended)
        return;
    std::string message;
    if (!context().blocks().empty() && !m_writer)
        message = "the program ended without RiEnd and RiWorldEnd: the world was not rendered";
    if (m_writer)
        message = "the program ended without RiEnd: \"" + (m_command.empty() ? m_name : m_command) +
                  "\" gets what was written";
    if (!message.empty() && error_handler != RiErrorIgnore)
        RiErrorPrint(RIE_NESTING, RIE_WARNING, message.data());
    if (!m_writer)
        return;
    error_handler = RiErrorPrint; // the program's function may be gone
    try {
        finish();
    } catch (const std::exception& e) {
        report(RIE_SYSTEM, RIE_SEVERE, e.what());
    }
}

// ---- calls ------------------------------------------------------------------------------------------

void Session::execute(ingest::Call& call) {
    if (m_ended) // in a callback of the call
        return;
    run(call);
    tell_heard();
}

void Session::run(ingest::Call& call) {
    if (m_writer) {
        m_writer->call(call);
        // The state is kept, for whatever depends on it: bases, colour samples, the size of procedurals.
        const std::string_view name = call.spec->name;
        const bool geometry = !(call.spec->scopes & ingest::InOuter) && name != "WorldEnd" &&
                              name != "FrameEnd" && name != "ObjectEnd" && !name.starts_with("Solid");
        if (geometry || name == "ReadArchive")
            return;
    }
    if (call.spec->name == "FrameEnd") // with it go the frame's options
        make_left_textures();
    m_reader->call(call);
    if (call.spec->handler == ingest::handlers::make_texture ||
        call.spec->handler == ingest::handlers::make_latlong_environment ||
        call.spec->handler == ingest::handlers::make_cube_face_environment)
        m_textures_left = !m_writer;
    if (call.spec->name != "WorldEnd")
        return;
    if (m_writer)
        context().take_world();
    else
        render_world();
}

Session::Listening::Listening(std::shared_ptr<Session> session, RtArchiveCallback callback)
    : m_session(std::move(session)) {
    if (!m_session)
        return;
    m_before = m_session->m_reader->listen({});
    if (callback)
        m_session->m_reader->listen(
            [callback, heard = m_session.get()](const char* type, const std::string& text) {
                if (heard->ended())
                    return;
                char format[] = "%s"; // the text may hold what looks like a format
                callback(const_cast<RtToken>(type), format, text.c_str());
            });
}

Session::Listening::~Listening() {
    if (m_session)
        m_session->m_reader->listen(std::move(m_before));
}

void Session::comment(const std::string& text) {
    if (m_ended)
        return;
    m_reader->record_line(text);
    if (m_writer)
        m_writer->comment(text);
}

void Session::verbatim(const std::string& text) {
    if (m_ended)
        return;
    m_reader->record_text(text);
    if (m_writer)
        m_writer->verbatim(text);
}

RtPointer Session::keep_handle(const std::string& text) {
    m_kept.push_back(text);
    return &m_kept.back();
}

const std::string* Session::handle(RtPointer pointer) const {
    for (const std::string& s : m_kept)
        if (&s == pointer)
            return &s;
    return nullptr;
}

static bool is_ours(RtErrorFunc handler) {
    return handler == RiErrorPrint || handler == RiErrorIgnore || handler == RiErrorAbort;
}

void Session::report(RtInt code, RtInt severity, const std::string& message) {
    if (code != RIE_NOERROR)
        RiLastError = code;
    if (m_recording) {
        if (severity >= RIE_WARNING)
            m_recording->problems += (m_recording->problems.empty() ? "" : "; ") + message;
        return;
    }
    if (!error_handler)
        return;
    std::string text = message; // handlers take char*
    if (is_ours(error_handler))
        return error_handler(code, severity, text.data());
    if (handling())
        return RiErrorPrint(code, severity, text.data());
    m_handling = __builtin_frame_address(0);
    error_handler(code, severity, text.data());
    m_handling = nullptr;
}

// A handler that was left by longjmp does not run: the stack has gone back beyond its caller.
bool Session::handling() const {
    return m_handling && std::less<>()(static_cast<const void*>(__builtin_frame_address(0)), m_handling);
}

void Session::hear(RtInt code, RtInt severity, std::string message) {
    if (m_recording || !error_handler || error_handler == RiErrorPrint || error_handler == RiErrorIgnore ||
        handling())
        report(code, severity, message);
    else
        m_heard.push_back({code, severity, std::move(message)});
}

void Session::tell_heard() {
    while (!m_heard.empty() && !handling()) {
        const Heard heard = std::move(m_heard.front());
        m_heard.pop_front();
        report(heard.code, heard.severity, heard.message);
    }
}

// ---- rendering --------------------------------------------------------------------------------------

// KANUKA_SHADERS, else beside the library (a wheel: beside its folder), else where it was built.
static std::string standard_shaders() {
    if (const char* given = std::getenv("KANUKA_SHADERS"); given && *given)
        return given;
    Dl_info info{};
    if (::dladdr(reinterpret_cast<void*>(&RiBegin), &info) && info.dli_fname) {
        const fs::path library = fs::absolute(info.dli_fname).parent_path();
        for (const fs::path& folder : {library / "shaders", library.parent_path() / "shaders",
                                       library.parent_path() / "share/kanuka/shaders"})
            if (fs::exists(folder / "matte.sl"))
                return folder.string();
    }
    return KANUKA_SHADERS_FOLDER;
}

// The first Display that goes to a file, as kanuka render has it.
static fs::path picture_path(const scene::Scene& scene) {
    for (const scene::Display& d : scene.options.displays)
        if (d.driver != "framebuffer" && !d.file.empty()) {
            const std::string name = d.file.substr(d.file.starts_with('+') ? 1 : 0);
            return name.ends_with(".png") ? name : scene::picture_file(name);
        }
    return "ri.exr";
}

// Textures are made when a world is rendered; these have none.
void Session::make_left_textures() {
    if (!m_textures_left)
        return;
    m_textures_left = false;
    const scene::Options& options = context().options.options;
    shade::make_textures(options.user, shade::search_folders(options.texture_path, "", ""), m_journal);
}

void Session::render_world() {
    std::optional<scene::Scene> scene = context().take_world();
    if (!scene)
        return;                 // a pass of depth for shadow maps, or a frame that was passed over
    scene->file = where().file; // as the RIB that the program writes, it comes of requests
    m_textures_left = false;
    render::Overrides overrides;
    overrides.standard_shaders = standard_shaders();
    Stats stats;
    const render::Result result = render::render(*scene, overrides, m_journal, stats, {});
    const fs::path path = picture_path(*scene);
    if (path.extension() == ".png") {
        const film::PngEncoding encoding =
            film::png_encoding(scene->options.color.display, scene->options.exposure_gamma);
        film::write_png(path.string(), result.picture, scene->options.exposure_gain, encoding.gamma,
                        encoding.display);
    } else {
        film::write_exr(path.string(), result.picture);
    }
    m_pictures++;
}

} // namespace kanuka::ri
