#include "ri/session.h"

#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>

#include "film/film.h"
#include "ingest/rib/handlers.h"
#include "render/session.h"
#include "ri/plug_in.h"
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
    static_cast<Session*>(user)->report(severity == RIE_INFO ? RIE_NOERROR : RIE_CONSISTENCY, severity,
                                        where + e.message);
}

static bool is_rib(const std::string& name) {
    return name.ends_with(".rib") || name.ends_with(".rib.gz") || name.ends_with(".rib.zst");
}

Session::Session(const std::string& name) : m_source(ingest::Source::from_text("", "")) {
    if (is_rib(name)) {
        m_output = ingest::open_output(name, ingest::packing_by_name(name));
        m_writer = std::make_unique<ingest::Writer>(*m_output, ingest::Writer::Form::Ascii);
        m_writer->comment("##RenderMan RIB-Structure 1.1");
    } else {
        m_journal.set_listener(heard, this);
    }
    ingest::RibOptions options;
    options.procedural = expand_by_library;
    m_reader = std::make_unique<ingest::Reader>(m_journal, ingest::FrameChoice{}, options, *m_source);
}

Session::Session(Recording& recording)
    : next_handle(1 << 30), m_recording(&recording), m_source(ingest::Source::from_text("", "")) {
    m_output = ingest::output_to(recording.text);
    m_writer = std::make_unique<ingest::Writer>(*m_output, ingest::Writer::Form::Ascii);
    m_reader =
        std::make_unique<ingest::Reader>(m_journal, ingest::FrameChoice{}, ingest::RibOptions{}, *m_source);
    ingest::Call world;
    world.spec = ingest::find_request("WorldBegin");
    world.where = where();
    m_reader->call(world);
}

void Session::finish() {
    if (m_writer) {
        m_writer->flush();
        m_output->finish();
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
}

// ---- calls ------------------------------------------------------------------------------------------

void Session::execute(ingest::Call& call) {
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

Session::Listening::Listening(Session* session, RtArchiveCallback callback) {
    if (!session)
        return;
    m_reader = session->m_reader.get();
    m_before = m_reader->listen({});
    if (callback)
        m_reader->listen([callback](const char* type, const std::string& text) {
            char format[] = "%s"; // the text may hold what looks like a format
            callback(const_cast<RtToken>(type), format, text.c_str());
        });
}

Session::Listening::~Listening() {
    if (m_reader)
        m_reader->listen(std::move(m_before));
}

void Session::comment(const std::string& text) {
    m_reader->record_line(text);
    if (m_writer)
        m_writer->comment(text);
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

void Session::report(RtInt code, RtInt severity, const std::string& message) {
    if (code != RIE_NOERROR)
        RiLastError = code;
    if (m_recording) {
        if (severity >= RIE_WARNING)
            m_recording->problems += (m_recording->problems.empty() ? "" : "; ") + message;
        return;
    }
    if (error_handler) {
        std::string text = message; // handlers take char*
        error_handler(code, severity, text.data());
    }
}

// ---- rendering --------------------------------------------------------------------------------------

// KANUKA_SHADERS, else beside the library, else where it was built.
static std::string standard_shaders() {
    if (const char* given = std::getenv("KANUKA_SHADERS"); given && *given)
        return given;
    Dl_info info{};
    if (::dladdr(reinterpret_cast<void*>(&current), &info) && info.dli_fname) {
        const fs::path library = fs::absolute(info.dli_fname).parent_path();
        for (const fs::path& folder : {library / "shaders", library.parent_path() / "share/kanuka/shaders"})
            if (fs::exists(folder / "matte.sl"))
                return folder.string();
    }
    return KANUKA_SHADERS_FOLDER;
}

// The first Display that goes to a file, as kanuka render has it.
static fs::path picture_path(const scene::Scene& scene) {
    for (const scene::Display& d : scene.options.displays)
        if (d.driver != "framebuffer" && !d.file.empty()) {
            const fs::path path = d.file.substr(d.file.starts_with('+') ? 1 : 0);
            return path.extension() == ".png" ? path : fs::path(path).replace_extension(".exr");
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
    const std::optional<scene::Scene> scene = context().take_world();
    if (!scene)
        return; // a pass of depth for shadow maps, or a frame that was passed over
    m_textures_left = false;
    render::Overrides overrides;
    overrides.standard_shaders = standard_shaders();
    Stats stats;
    const render::Result result = render::render(*scene, overrides, m_journal, stats, {});
    const fs::path path = picture_path(*scene);
    if (path.extension() == ".png")
        film::write_png(path.string(), result.picture, scene->options.exposure_gain, 1,
                        color::find_display(scene->options.color.display).value_or(color::Display::Srgb));
    else
        film::write_exr(path.string(), result.picture);
    m_pictures++;
}

} // namespace kanuka::ri
