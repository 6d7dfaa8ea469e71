// kanuka.Session, and kanuka.render(), which is one from beginning to end.
#include <cstdio>

#include <nanobind/stl/filesystem.h>

#include "python/render_request.h"
#include "python/supervisor.h"
#include "render/session.h"

namespace kanuka::python {

namespace {

class Session {
  public:
    // What a session takes that render() does not.
    struct Own {
        render::Session::Keep keep = render::Session::Keep::Nothing;
        std::optional<uint64_t> page_memory;
        std::optional<render::Part> part;
        bool records_oracle = false;
    };
    Session(std::shared_ptr<Scene> scene, const Own& own, const char* call, const nb::kwargs& keywords)
        : m_scene(std::move(scene)), m_own(own), m_call(call), m_keywords(keywords) {
        const RenderRequest request = take(m_keywords);
        m_messages.emplace(request.journal);
        Journal& journal = *m_messages->journal;
        m_session =
            std::make_unique<render::Session>(m_scene->scene, request.overrides, own.keep, journal, *m_stats);
    }

    // False: the time is up, or it was cancelled.
    bool advance(std::optional<int> progressions, std::optional<double> seconds, nb::object progress) {
        if (progressions && *progressions < 1)
            throw nb::value_error("advance: progressions must be 1 or more");
        if (seconds && !(*seconds > 0))
            throw nb::value_error("advance: seconds must be above 0");
        bool done = false;
        supervise(progress, [&](Supervisor& supervisor) {
            if (!m_session->prepare(supervisor.progress()))
                return;
            using Clock = Supervisor::Clock;
            const auto until = seconds && *seconds < 1e9
                                   ? Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                        std::chrono::duration<double>(*seconds))
                                   : Clock::time_point::max();
            done = m_session->advance(progressions.value_or(m_session->wanted()), supervisor.progress(until));
        });
        return done;
    }

    void prepare(nb::object progress) {
        supervise(progress, [&](Supervisor& supervisor) { m_session->prepare(supervisor.progress()); });
    }

    // The scene has changed, or what is set over it; `scene`: another takes its place.
    void update(std::shared_ptr<Scene> scene, const nb::kwargs& keywords) {
        nb::kwargs all = nb::borrow<nb::kwargs>(nb::handle(m_keywords).attr("copy")());
        for (auto [name, value] : keywords)
            all[name] = value;
        if (scene)
            check_idle(*scene);
        const std::shared_ptr<Scene> before = m_scene; // stays until the session has let go of it
        const std::shared_ptr<Stats> stats_before = std::exchange(m_stats, std::make_shared<Stats>());
        if (scene)
            m_scene = std::move(scene);
        RenderRequest request;
        try {
            request = take(all);
        } catch (...) {
            m_scene = before, m_stats = stats_before;
            throw;
        }
        m_keywords = all;
        const Reading reading(*m_scene);
        m_is_told = false;
        if (m_scene == before)
            return m_session->update(request.overrides, *m_stats);
        const std::optional<Messages> messages_before = m_messages;
        m_messages.emplace(request.journal);
        m_session->update(m_scene->scene, request.overrides, *m_messages->journal, *m_stats);
    }

    void save(const std::filesystem::path& path) {
        const Reading reading(*m_scene);
        m_session->save(path.string());
    }
    void resume(const std::filesystem::path& path, nb::object progress) {
        supervise(progress,
                  [&](Supervisor& supervisor) { m_session->resume(path.string(), supervisor.progress()); });
    }

    // As it is now.
    Picture picture() {
        const Reading reading(*m_scene);
        const bool whole = m_session->progressions() >= m_session->wanted();
        Picture picture = made(!whole);
        picture.picture = whole && !m_is_told ? m_session->finish() : m_session->picture();
        if (whole && !m_is_told)
            m_messages->tell();
        m_is_told |= whole;
        if (picture.picture.channels.empty())
            throw nb::value_error("there is no picture yet: advance() makes one");
        return picture;
    }
    // From the beginning to the end. Ctrl-C is no error where there is something to be kept.
    Picture whole_picture(nb::handle progress) {
        Supervisor supervisor(progress);
        bool done = false;
        film::Picture finished;
        {
            const Reading reading(*m_scene);
            supervisor.run(
                [&] {
                    done = m_session->advance(m_session->wanted(), supervisor.progress());
                    finished = m_session->finish();
                },
                *m_messages);
        }
        if (m_messages->tells)
            for (const Journal::Entry& e : m_scene->journal->entries()) // what reading the scene reported
                for (uint64_t i = 0; i < e.count; i++)
                    m_messages->journal->report(e.severity, e.where, e.message);
        if (finished.channels.empty()) // nothing to keep
            supervisor.rethrow_interrupt();
        Picture picture = made(!done);
        picture.picture = std::move(finished);
        return picture;
    }

    render::Session::Recorded save_oracle(const std::filesystem::path& path) const {
        return m_session->save_oracle(path.string());
    }
    int progressions() const { return m_session->progressions(); }
    int wanted() const { return m_session->wanted(); }
    bool prepared() const { return m_session->prepared(); }
    const Stats& stats() const { return *m_stats; }
    const std::vector<render::MadeAgain::Reason>& made_again() const { return m_session->made_again(); }

  private:
    RenderRequest take(const nb::kwargs& keywords) {
        RenderRequest request;
        take_keywords(request, render_keywords(), m_call, keywords);
        request.complete(*m_scene);
        render::Overrides& overrides = request.overrides;
        overrides.page_memory = m_own.page_memory;
        overrides.part = m_own.part;
        overrides.records_oracle = m_own.records_oracle;
        scene::Options options = m_scene->options;
        request.overrides.options.apply(options);
        m_stats->time.ingest_s = m_stats->time.total_s = m_scene->ingest_s;
        m_exposure_gain = options.exposure_gain;
        m_encoding = film::png_encoding(options.color.display, options.exposure_gamma);
        return request;
    }

    // All but its pixels.
    Picture made(bool cancelled) {
        m_session->close_statistics();
        Picture picture;
        picture.journal = m_messages->journal;
        picture.stats = m_stats;
        picture.exposure_gain = m_exposure_gain;
        picture.encoding = m_encoding;
        picture.cancelled = cancelled;
        return picture;
    }

    template <class Work>
    void supervise(nb::handle progress, const Work& work) {
        if (!progress.is_none() && !PyCallable_Check(progress.ptr()))
            wrong_argument("progress", "a callable or None", progress);
        Supervisor supervisor(progress);
        const Reading reading(*m_scene);
        supervisor.run([&] { work(supervisor); }, *m_messages);
        supervisor.rethrow_interrupt();
    }

    std::shared_ptr<Scene> m_scene;
    Own m_own;
    const char* m_call;
    nb::kwargs m_keywords;
    std::optional<Messages> m_messages;
    std::shared_ptr<Stats> m_stats = std::make_shared<Stats>();
    float m_exposure_gain = 1;
    film::PngEncoding m_encoding;
    bool m_is_told = false; // what was wrong with the picture's samples
    std::unique_ptr<render::Session> m_session;
};

// A method as define() takes it.
template <class R, class... A>
std::function<R(Session&, A...)> method(R (Session::*f)(A...)) {
    return [f](Session& self, A... a) { return (self.*f)(std::forward<A>(a)...); };
}

void init_session(Session* self, std::shared_ptr<Scene> scene, const nb::kwargs& given) {
    check_idle(*scene);
    nb::kwargs keywords = nb::borrow<nb::kwargs>(nb::handle(given).attr("copy")());
    if (keywords.contains("progress"))
        throw nb::type_error("Session: progress is an argument of advance()");
    using Keep = render::Session::Keep;
    Session::Own own{.keep = Keep::Pages};
    if (keywords.contains("keep_pages")) {
        own.keep = argument<bool>(keywords["keep_pages"], "keep_pages") ? Keep::Pages : Keep::Keys;
        nb::del(keywords["keep_pages"]);
    }
    if (keywords.contains("page_memory")) {
        if (const auto megabytes = argument<std::optional<double>>(keywords["page_memory"], "page_memory")) {
            if (!(*megabytes >= 0) || *megabytes > 1e12)
                throw nb::value_error("Session: page_memory must be 0 or more megabytes");
            own.page_memory = uint64_t(*megabytes * (1 << 20));
        }
        nb::del(keywords["page_memory"]);
    }
    if (keywords.contains("part")) {
        using Range = std::pair<int, int>;
        if (const auto range = argument<std::optional<Range>>(keywords["part"], "part"))
            own.part = render::Part{range->first, range->second};
        nb::del(keywords["part"]);
    }
    new (self) Session(std::move(scene), own, "Session", keywords);
}

Picture render(std::shared_ptr<Scene> scene, const nb::kwargs& keywords) {
    check_idle(*scene);
    RenderRequest of_call;
    take_keywords(of_call, render_keywords(), "render", keywords);
    Session session(std::move(scene), Session::Own(), "render", keywords);
    Picture picture = session.whole_picture(of_call.progress);
    char seconds[32];
    std::snprintf(seconds, sizeof seconds, "%.2f", picture.stats->time.total_s);
    log(std::to_string(picture.picture.width) + " × " + std::to_string(picture.picture.height) +
        " pixels in " + seconds + " s");
    return picture;
}

// A few paths a pixel in coarse geometry tell where rays go.
nb::dict write_oracle(std::shared_ptr<Scene> scene, const std::filesystem::path& path,
                      const nb::kwargs& given) {
    check_idle(*scene);
    nb::kwargs keywords = nb::borrow<nb::kwargs>(nb::handle(given).attr("copy")());
    const auto otherwise = [&](const char* name, nb::object value) {
        if (!keywords.contains(name) || nb::handle(keywords[name]).is_none())
            keywords[name] = value;
    };
    otherwise("progressions", nb::int_(4));
    otherwise("shading_rate", nb::float_(16));
    RenderRequest of_call;
    take_keywords(of_call, render_keywords(), "write_oracle", keywords);
    if (keywords.contains("integrator") && !nb::handle(keywords["integrator"]).is_none())
        throw nb::value_error("write_oracle: integrator: oracles are recorded by footprints");
    keywords["integrator"] = "footprints";
    Session session(std::move(scene), {.records_oracle = true}, "write_oracle", keywords);
    // Ctrl-C: half a record would say that half of the scene is not seen.
    session.advance(std::nullopt, std::nullopt, of_call.progress);
    const render::Session::Recorded recorded = session.save_oracle(path);
    nb::dict found;
    found["primitives"] = recorded.primitives;
    found["seen"] = recorded.seen;
    return found;
}

nb::dict kept_of(const Session& session) {
    const Stats::Count& count = session.stats().count;
    nb::dict kept;
    kept["primitives"] = count.primitives.load();
    kept["primitives_kept"] = count.primitives_kept.load();
    kept["primitives_evicted"] = count.primitives_evicted.load();
    kept["primitives_stored"] = count.primitives_stored.load();
    kept["hierarchies_kept"] = count.hierarchies_kept.load();
    return kept;
}

nb::list made_again_of(const Session& session) {
    nb::list all;
    for (const render::MadeAgain::Reason& reason : session.made_again()) {
        nb::dict each;
        each["why"] = reason.why;
        each["primitives"] = reason.primitives;
        each["name"] = reason.name;
        each["id"] = reason.id;
        each["file"] = reason.where.file.str();
        each["line"] = reason.where.line;
        all.append(each);
    }
    return all;
}

void bind_kept(nb::class_<Session>& session) {
    session
        .def_prop_ro(
            "kept", &kept_of, nb::sig("def kept(self) -> dict[str, int]"),
            "What the last making of the scene had of the one before: 'primitives' there are, "
            "'primitives_kept' of "
            "them,\n'primitives_evicted' that were known but had found no room in page_memory and were made "
            "again, 'primitives_stored'\nthat the store on disk had, and 'hierarchies_kept' (1: nothing was "
            "built).")
        .def_prop_ro(
            "made_again", &made_again_of, nb::sig("def made_again(self) -> list[dict[str, object]]"),
            "Why the last making of the scene has diced and shaded primitives, which the one before had "
            "not, or of other\ninputs: dicts of 'why' (\"shape\", \"surface parameter Ks\", \"texture "
            "wood.tx\", \"camera step\", …), 'primitives', how many, and\n'name', 'id', 'file' and 'line' of "
            "the first of them. One that has several reasons counts for each. Of the first making: "
            "\"first\".");
}

void bind_oracle(nb::module_& m) {
    static const std::string sig = "def write_oracle(scene: Scene, path: str | os.PathLike, *" +
                                   keyword_signature(render_keywords()) + ") -> dict[str, int]";
    define(m, "write_oracle", &write_oracle, nb::arg("scene"), nb::arg("path"), nb::arg("keywords"),
           nb::sig(sig.c_str()),
           "Records how finely each part of each primitive is looked at: by the camera, in mirrors and "
           "through glass, by "
           "bounces and\nin shadows. render(oracle=path) dices by that. Takes the arguments of render(); "
           "where they are not "
           "given, progressions\nare 4 and shading_rate is 16. What moves is not recorded. Returns how many "
           "'primitives' there "
           "are, and how many were 'seen'.");
}

} // namespace

void bind_session(nb::module_& m) {
    static const std::string // nanobind keeps the pointers
        arguments = keyword_signature(render_keywords()),
        sig = "def render(scene: Scene, *" + arguments + ") -> Picture",
        about = "Renders a scene. Arguments go over the scene's own options; None leaves them.\n" +
                keyword_doc(render_keywords()) +
                "\n\nCtrl-C stops early and returns what is there, with `cancelled` set. What is missing or "
                "replaced is a kanuka.Warning,\nand in the picture's journal.",
        sig_of_session =
            "def __init__(self, scene: Scene, *, keep_pages: bool = True, page_memory: float | None = None, "
            "part: tuple[int, int] | None = None" +
            arguments + ") -> None",
        sig_of_update = "def update(self, scene: Scene | None = None, *" + arguments + ") -> None";
    define(m, "render", &render, nb::arg("scene"), nb::arg("keywords"), nb::sig(sig.c_str()), about.c_str());

    bind_oracle(m);
    define(
        m, "check_layer", [](const std::string& text) { check_layer(text, "text"); }, nb::arg("text"),
        "Raises ValueError if `text` is a light path expression that cannot be read, with the column, what "
        "is\n"
        "there and what was expected. Whether a scene has a layer of another name is seen when it is "
        "rendered.");

    nb::class_<Session> session(
        m, "Session",
        "A picture that is made step by step: it can be looked at on the way, stopped, saved and continued, "
        "and made again\nafter edits of the scene at the cost of what they touch. Takes the arguments of "
        "render(), but for progress.\nkeep_pages=False keeps no diced and shaded geometry for update(). "
        "page_memory: megabytes of it that are kept\n(None: a quarter of the machine's memory); what finds "
        "no "
        "room is made again by every update. part: renders these\nprogressions of the picture alone, the "
        "first and the one after the last, for merge(): multiples of 64, or the\npicture's end.");
    define(session, "__init__", &init_session, nb::arg("scene"), nb::arg("keywords"),
           nb::sig(sig_of_session.c_str()));
    define(
        session, "advance", method(&Session::advance), nb::kw_only(), nb::arg("progressions") = nb::none(),
        nb::arg("seconds") = nb::none(), nb::arg("progress") = nb::none(),
        nb::sig(
            "def advance(self, *, progressions: int | None = None, seconds: float | None = None, progress: "
            "Callable[[str, float], object] | None = None) -> bool"),
        "Traces until every pixel has so many paths (None: as many as the scene or the session says). "
        "seconds: "
        "stops then\nand returns False; what comes before tracing takes as long as it takes. Ctrl-C raises "
        "KeyboardInterrupt; the session\ncan go on after it.");
    define(session, "prepare", method(&Session::prepare), nb::kw_only(), nb::arg("progress") = nb::none(),
           nb::sig("def prepare(self, *, progress: Callable[[str, float], object] | None = None) -> None"),
           "All that comes before tracing: dicing, shading, the hierarchy, lights. advance() does it where "
           "it is due.");
    define(session, "update", method(&Session::update), nb::arg("scene") = nb::none(), nb::arg("keywords"),
           nb::sig(sig_of_update.c_str()),
           "The scene has changed; arguments replace those of the session. The next advance() begins the "
           "picture "
           "anew, and dices\nand shades only what has changed. `scene`: another one takes its place, as the "
           "next frame of a "
           "shot; what is alike\nin both is neither diced nor shaded again.");
    define(
        session, "save", method(&Session::save), nb::arg("path"),
        "Writes the samples so far. The file is known by all that they depend on: scene, shaders, textures, "
        "options, seed.");
    define(
        session, "resume", method(&Session::resume), nb::arg("path"), nb::kw_only(),
        nb::arg("progress") = nb::none(),
        nb::sig(
            "def resume(self, path: str | os.PathLike, *, progress: Callable[[str, float], object] | None = "
            "None) -> None"),
        "Continues what save() wrote, of this picture: the same bits as without the stop. Raises Error if it "
        "is "
        "of another.");
    session
        .def("picture", &Session::picture, nb::sig("def picture(self) -> Picture"),
             "As it is now; `cancelled` tells whether paths are still wanted.")
        .def_prop_ro("progressions", &Session::progressions, "Paths that every pixel has.")
        .def_prop_ro("prepared", &Session::prepared, "Can rays be traced, and samples be saved?")
        .def_prop_ro("wanted", &Session::wanted, "Paths that advance() goes to.");
    bind_kept(session);
}

} // namespace kanuka::python
