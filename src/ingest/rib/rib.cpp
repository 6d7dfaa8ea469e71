#include "ingest/rib/rib.h"

#include "ingest/rib/on_demand.h"
#include "ingest/rib/reader.h"

namespace kanuka::ingest {

static scene::Scene read_source(const std::shared_ptr<const Source>& source, const RibOptions& options,
                                Journal& journal) {
    // Shadow-map passes are passed over. Where a file holds nothing else, the first of them is what is
    // wanted.
    for (const bool take_depth_pass : {false, true}) {
        const auto owner =
            std::make_shared<Reader>(journal, FrameChoice{options.frame, take_depth_pass}, options, *source);
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
