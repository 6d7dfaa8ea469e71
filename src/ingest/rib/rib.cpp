#include "ingest/rib/rib.h"

#include <set>

#include "ingest/rib/on_demand.h"
#include "ingest/rib/reader.h"

namespace kanuka::ingest {

// Pictures that MakeTexture and its kin read, of a text of several frames: a frame that writes them is not
// what somebody wants to see. Found by a look at the text, since frames come before what reads them.
static std::set<std::string, std::less<>> texture_sources(std::string_view text) {
    std::set<std::string, std::less<>> sources;
    constexpr size_t Largest = size_t(1) << 28; // what is larger is geometry
    if (text.size() > Largest || text.find("FrameBegin") == std::string_view::npos)
        return sources;
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
    return sources;
}

static scene::Scene read_source(const std::shared_ptr<const Source>& source, const RibOptions& options,
                                Journal& journal) {
    // Shadow-map passes are passed over. Where a file holds nothing else, the first of them is what is
    // wanted.
    const auto sources = texture_sources(source->text());
    for (const bool take_depth_pass : {false, true}) {
        const auto owner = std::make_shared<Reader>(
            journal, FrameChoice{options.frame, take_depth_pass, &sources}, options, *source);
        Reader& reader = *owner;
        std::shared_ptr<OnDemand> delayed;
        if (options.on_demand)
            delayed = std::make_shared<OnDemand>(), reader.context().delayed = delayed.get();
        reader.run(source);
        Context& context = reader.context();
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
            context.reports.error(
                "no world", source->locate(0),
                "the file has no WorldBegin … WorldEnd: there is nothing to render. An archive is "
                "rendered through a scene that reads it");
        }
        scene::Scene scene = std::move(context.scene());
        scene.file = source->name();
        if (delayed && !delayed->bounds().empty()) {
            delayed->take(owner, source);
            *options.on_demand = delayed;
        }
        return scene;
    }
    return {};
}

scene::Scene read_rib(const std::string& path, const RibOptions& options, Journal& journal) {
    return read_source(Source::open(path), options, journal);
}

scene::Scene parse_rib(const std::string& text, const std::string& name, const RibOptions& options,
                       Journal& journal) {
    return read_source(Source::from_text(text, name), options, journal);
}

} // namespace kanuka::ingest
