#include "ingest/rib/rib.h"

#include <cctype>
#include <set>
#include <span>

#include "ingest/rib/on_demand.h"
#include "ingest/rib/reader.h"

namespace kanuka::ingest {

// Pictures that MakeTexture and its kin read, of a text of several frames: a frame that writes them is not
// what somebody wants to see. Found by a look at the text, since frames come before what reads them.
using Names = std::set<std::string, std::less<>>;
constexpr size_t LargestLookedAt = size_t(1) << 28; // what is larger is geometry

static void find_texture_sources(std::string_view text, Names& sources) {
    if (text.size() > LargestLookedAt || text.find("FrameBegin") == std::string_view::npos)
        return;
    for (const std::string_view request :
         {"MakeTexture", "MakeBump", "MakeLatLongEnvironment", "MakeCubeFaceEnvironment"})
        for (size_t at = text.find(request); at != std::string_view::npos; at = text.find(request, at + 1)) {
            const int pictures = request == "MakeCubeFaceEnvironment" ? 6 : 1;
            size_t open = at;
            for (int k = 0; k < pictures; k++) {
                open = text.find('"', open);
                const size_t close = open == std::string_view::npos ? open : text.find('"', open + 1);
                if (close == std::string_view::npos)
                    break;
                sources.emplace(text.substr(open + 1, close - open - 1));
                open = close + 1;
            }
        }
}

// Where a text's frames begin. A word in a comment is none.
static std::vector<size_t> find_frames(std::string_view text) {
    std::vector<size_t> frames;
    if (text.size() > LargestLookedAt)
        return frames;
    for (size_t at = text.find("FrameBegin"); at != std::string_view::npos;
         at = text.find("FrameBegin", at + 1)) {
        const size_t line = text.find_last_of("\r\n", at);
        const std::string_view before = text.substr(line + 1, at - line - 1);
        if (before.find('#') == std::string_view::npos &&
            (before.empty() || std::isspace(static_cast<unsigned char>(before.back()))))
            frames.push_back(at);
    }
    return frames;
}

// One of many is read: who reads the first by default is told of the others.
static void tell_of_frames(const Source& source, Context& context) {
    const std::vector<size_t> frames = find_frames(source.text());
    const size_t read = context.frames_seen().size();
    if (frames.size() < 2 || read < 1 || read > frames.size())
        return;
    const int number = context.frames_seen().back();
    context.reports.info("frames", source.locate(frames[read - 1]),
                         "frame " + std::to_string(number) + " is read, " +
                             (read == 1 ? "the first" : "number " + std::to_string(read)) + " of " +
                             std::to_string(frames.size()) +
                             "; ask for others by their numbers (kanuka render --frame N, or all)");
}

// Several are read one after another as if they were one.
static scene::Scene read_sources(std::span<const std::shared_ptr<const Source>> files,
                                 const RibOptions& options, Journal& journal) {
    const std::shared_ptr<const Source>& source = files.back();
    Names sources;
    for (const auto& file : files)
        find_texture_sources(file->text(), sources);
    Reports::Said said;
    // Shadow-map passes are passed over. Where a file holds nothing else, the first of them is what is
    // wanted.
    for (const bool take_depth_pass : {false, true}) {
        const auto owner = std::make_shared<Reader>(
            journal, FrameChoice{options.frame, take_depth_pass, &sources, nullptr, options.repeat}, options,
            *source);
        Reader& reader = *owner;
        std::shared_ptr<OnDemand> delayed;
        if (options.on_demand)
            delayed = std::make_shared<OnDemand>(), reader.context().delayed = delayed.get();
        Context& context = reader.context();
        if (take_depth_pass)
            context.reports.leave_out(&said);
        else
            context.reports.remember(&said);
        std::shared_ptr<const Source> of_world = source;
        for (const auto& file : files) {
            const bool before = context.world_done();
            reader.run(file);
            if (!before && context.world_done())
                of_world = file;
        }
        context.reports.remember(nullptr);
        context.reports.leave_out(nullptr);
        if (!take_depth_pass && !context.world_done() && context.depth_pass_skipped())
            continue;
        context.finish(source->locate(source->text().size()));
        if (!context.world_done()) {
            if (options.frame != 0 && !context.frames_seen().empty()) {
                std::string frames;
                for (const int n : context.frames_seen())
                    frames += (frames.empty() ? "" : ", ") + std::to_string(n);
                throw Error(Location{source->name()}, "there is no frame " + std::to_string(options.frame) +
                                                          " with a world; the frames are: " + frames);
            }
            context.reports.error("no world", source->locate(0),
                                  "the file has no WorldBegin … WorldEnd: there is nothing to render" +
                                      (context.left_outside() > 0
                                           ? ", and " + std::to_string(context.left_outside()) +
                                                 " requests that belong into a world were left out"
                                           : std::string()) +
                                      ". An archive is rendered through a scene that reads it");
        }
        if (options.frame == 0 && context.world_in_frame())
            tell_of_frames(*of_world, context);
        scene::Scene scene = std::move(context.scene());
        scene.file = of_world->name();
        if (delayed && !delayed->bounds().empty()) {
            delayed->take(owner, source);
            *options.on_demand = delayed;
        }
        return scene;
    }
    return {};
}

scene::Scene read_rib(const std::string& path, const RibOptions& options, Journal& journal) {
    const std::shared_ptr<const Source> source = Source::open(path);
    return read_sources({&source, 1}, options, journal);
}

scene::Scene read_ribs(std::span<const std::string> paths, const RibOptions& options, Journal& journal) {
    std::vector<std::shared_ptr<const Source>> sources;
    for (const std::string& path : paths)
        sources.push_back(Source::open(path));
    return read_sources(sources, options, journal);
}

scene::Camera read_camera(std::span<const std::string> paths, const RibOptions& options) {
    std::vector<std::shared_ptr<const Source>> files;
    Names sources;
    for (const std::string& path : paths) {
        files.push_back(Source::open(path));
        find_texture_sources(files.back()->text(), sources);
    }
    Journal unheard; // whoever reads the world is told
    for (const bool take_depth_pass : {false, true}) {
        Reader reader(unheard,
                      FrameChoice{options.frame, take_depth_pass, &sources, nullptr, options.repeat, true},
                      options, *files.back());
        for (const auto& file : files)
            reader.run(file);
        if (reader.context().world_done() || !reader.context().depth_pass_skipped())
            return reader.context().scene().camera;
    }
    return {};
}

std::vector<RibFrame> read_frames(std::span<const std::string> paths, const RibOptions& options) {
    std::vector<std::shared_ptr<const Source>> files;
    Names sources;
    for (const std::string& path : paths) {
        files.push_back(Source::open(path));
        find_texture_sources(files.back()->text(), sources);
    }
    std::vector<RibFrame> frames;
    Journal unheard; // whoever reads one of them is told
    Reader reader(unheard, FrameChoice{0, false, &sources, &frames}, options, *files.back());
    for (const auto& file : files)
        reader.run(file);
    return frames;
}

scene::Scene parse_rib(const std::string& text, const std::string& name, const RibOptions& options,
                       Journal& journal) {
    const std::shared_ptr<const Source> source = Source::from_text(text, name);
    return read_sources({&source, 1}, options, journal);
}

} // namespace kanuka::ingest
