// Reads RIB (ASCII, gzip, archives) into the scene model.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "ingest/rib/expansions.h"
#include "scene/delayed.h"

namespace kanuka::ingest {

// A procedural that somebody's own code may expand.
struct ProceduralRequest {
    std::string type; // DynamicLoad, RunProgram, DelayedReadArchive, or a name of the plug-in's own
    std::vector<std::string> arguments;
    double detail; // pixels of its bound's image; 1e38 where that has no end
    Location where;
    std::vector<float> bound = {};         // in the current space, as RiBound; empty = none
    std::vector<std::string> folders = {}; // where what it names is looked for
    scene::ValueList parameters = {};      // of Procedural2
    std::vector<std::string> declared =
        {};                 // "name" "declaration" …: the scene's own, for who makes RIB of it
    bool in_object = false; // between ObjectBegin and ObjectEnd
    bool may_run = true;    // code that is not part of the renderer
    // Who makes use of `detail` says so: what does not is the same at any.
    std::shared_ptr<std::atomic<bool>> uses_detail = std::make_shared<std::atomic<bool>>(false);
};

struct RibOptions {
    std::vector<std::string> archive_path; // searched after the folder of the file that asks
    // The number of a FrameBegin; 0 = the first frame that writes more than depth (shadow-map passes are
    // passed over).
    int frame = 0;
    int repeat = 0;           // of frames of that number, how many come before it
    bool run_programs = true; // Procedural "RunProgram" may start processes
    bool run_system = false;  // System may have the shell do anything
    // Gives RIB for a procedural, or nothing where it does not know it; asked before anything else. What it
    // throws is reported at the procedural.
    std::function<std::optional<std::string>(const ProceduralRequest&)> procedural = {};
    // Where procedurals with bounds go that may be read later; null = all are read at once. Not for worlds
    // that stand between the calls of a program.
    std::shared_ptr<scene::Delayed>* on_demand = nullptr;
    // What programs and plug-ins make is looked for there first; null = they are asked each time.
    std::shared_ptr<Expansions::Frame> expansions = {};
    size_t most_procedurals = size_t(1) << 24; // in a scene; they nest 100 deep at most
};

// A frame of a file that has a world, or a world outside of all frames: they count from 1.
struct RibFrame {
    int number = 0;
    Location where;
    bool picture = true; // false: it writes what shadow maps or textures are made of, alone
    bool source = false; // it writes what a texture of the file is made of
    int repeat = 0;      // frames of that number before it
};

// Throws Error where the file cannot be read at all; everything else is reported with file, line, column and
// mend, and reading goes on at the next request. "-" reads standard input.
scene::Scene read_rib(const std::string& path, const RibOptions& options, Journal& journal);
// One or more, read one after another as one stream: options in the first hold for the scene in the last.
scene::Scene read_ribs(std::span<const std::string> paths, const RibOptions& options, Journal& journal);
// That of the world: all that is read is what stands before it.
scene::Camera read_camera(std::span<const std::string> paths, const RibOptions& options);
// All that RibOptions::frame may ask for, in order. Worlds are passed over; nothing is reported.
std::vector<RibFrame> read_frames(std::span<const std::string> paths, const RibOptions& options);
scene::Scene parse_rib(const std::string& text, const std::string& name, const RibOptions& options,
                       Journal& journal);

} // namespace kanuka::ingest
