// Procedural and Procedural2: geometry that something else makes.

#include <algorithm>
#include <cmath>
#include <limits>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"
#include "ingest/rib/on_demand.h"
#include "ingest/rib/search_path.h"
#include "ingest/rib/view_bound.h"

namespace kanuka::ingest::handlers {

using scene::Value;

namespace {

using Request = ProceduralCall;

Bounds3f box_of(const std::vector<float>& bound) {
    Bounds3f b;
    b.extend(Vec3f(bound[0], bound[2], bound[4]));
    b.extend(Vec3f(bound[1], bound[3], bound[5]));
    return b;
}

std::vector<std::string> folders_of(Context& c) {
    std::vector<std::string> folders{c.stream.folder()};
    const std::string path = c.options.options.user.get_string("searchpath:procedural", "");
    if (!path.empty())
        for (std::string& f : expand_search_path(path, c.default_path, c.default_path, c.stream.folder()))
            folders.push_back(std::move(f));
    folders.insert(folders.end(), c.options.options.archive_path.begin(),
                   c.options.options.archive_path.end());
    return folders;
}

void fail(Context& c, const Request& r, const std::string& why) {
    c.reports.error("Procedural " + r.type, r.where,
                    "Procedural \"" + r.type + "\"" +
                        (r.arguments.empty() ? "" : " \"" + r.arguments[0] + "\"") + " was left out: " + why);
}

// Code of others: programs, and the libraries and scripts of DynamicLoad.
bool may_run(const Context& c) {
    return c.rib_options.run_programs && c.options.options.user.get_int("procedural:runprograms", 1) != 0;
}

std::string run_program(Context& c, const ProceduralRequest& r) {
    if (!r.may_run)
        throw Error("running programs is forbidden; run it beforehand, save its RIB, and use "
                    "\"DelayedReadArchive\"");
    r.uses_detail->store(true);
    // RISpec 5.9: the detail and the arguments, as a line.
    const std::string line =
        std::to_string(r.detail) + " " + (r.arguments.size() > 1 ? r.arguments[1] : "") + "\n";
    return c.programs.ask(r.arguments[0], r.folders, line);
}

// Of this frame and others; null = it is rendered by itself.
Expansions::Frame* shared_expansions(const Context& c) {
    return c.options.options.user.get_int("procedural:shared", 1) != 0 ? c.rib_options.expansions.get()
                                                                       : nullptr;
}

// False: neither a program nor a plug-in.
bool ask_code(Context& c, const Request& r, double detail) {
    const ProceduralRequest request{r.type,
                                    r.arguments,
                                    detail,
                                    r.where,
                                    r.bound,
                                    folders_of(c),
                                    r.parameters,
                                    c.declarations.own(),
                                    c.scope() == InObject,
                                    may_run(c)};
    const auto ask = [&]() -> std::optional<std::string> {
        if (c.rib_options.procedural)
            if (std::optional<std::string> rib = c.rib_options.procedural(request))
                return rib;
        if (r.type == "RunProgram" && !r.arguments.empty())
            return run_program(c, request);
        return std::nullopt;
    };
    Expansions::Frame* const frame = shared_expansions(c);
    std::optional<std::string> rib;
    try {
        rib = frame ? frame->answer(request, ask) : ask();
    } catch (const std::exception& e) {
        fail(c, r, e.what());
        return true;
    }
    if (rib)
        c.stream.read_text(std::move(*rib),
                           (r.arguments.empty() ? r.type : r.arguments[0]) + " (" + r.type + ")", r.where);
    return rib.has_value();
}

// Pixels that the bound covers; of a shot, where it covers most.
double detail_of(const Context& c, const Bounds3f& bound) {
    double area = view_bound(c, bound, c.camera_from_current()).area;
    if (const Expansions::Frame* frame = c.in_world() ? shared_expansions(c) : nullptr)
        for (const scene::Camera& camera : frame->shot())
            area = std::max(area, view_bound(c, camera, bound, c.world_from_current()).area);
    return area;
}

// A procedural starts from the state around it and leaves none behind.
void expand(Context& c, const Request& r) {
    if (++c.procedurals > c.rib_options.most_procedurals) {
        c.reports.once(Severity::Error, "too many procedurals", r.where,
                       "this procedural and those after it were left out: there are more than " +
                           std::to_string(c.rib_options.most_procedurals));
        return;
    }
    if (!c.attributes.detail_visible)
        return;
    bool bounded = r.bound.size() == 6;
    for (const float f : r.bound)
        bounded &= std::isfinite(f);
    if (bounded) {
        const Bounds3f b = box_of(r.bound);
        const ViewBound view = view_bound(c, b, c.camera_from_current());
        // Rays reach what lies beside the picture; who knows that nothing there matters may say so.
        if (view.outside && c.options.options.user.get_int("procedural:offscreen", 1) == 0)
            return;
        if (c.may_delay()) {
            Bounds3f world;
            for (int corner = 0; corner < 8; corner++)
                world.extend(c.ctm.point({corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y,
                                          corner & 4 ? b.hi.z : b.lo.z}));
            c.lights.shine_on(c.attributes);
            c.delayed->add(r, c, world);
            return;
        }
    }
    expand_procedural(c, r);
}

} // namespace

void expand_procedural(Context& c, const Request& r) {
    double detail = std::numeric_limits<double>::infinity();
    if (r.bound.size() == 6)
        detail = detail_of(c, box_of(r.bound));
    if (!std::isfinite(detail)) // as other renderers have it
        detail = 1e38;
    c.open(BlockKind::Attribute, r.where);
    const size_t depth = c.blocks().size();
    if (ask_code(c, r, detail)) {
        // done, or reported
    } else if (r.type == "DelayedReadArchive" && !r.arguments.empty()) {
        c.stream.read_archive(r.arguments[0], r.where);
    } else if (r.arguments.empty()) {
        fail(c, r, "it has no arguments");
    } else {
        fail(c, r,
             r.type == "DynamicLoad" ? "no plug-in of that name has been registered; see docs/rib.md"
                                     : "there are DelayedReadArchive, RunProgram and DynamicLoad");
    }
    if (c.blocks().size() >= depth)
        c.close(BlockKind::Attribute, r.where);
}

void procedural(Context& c, Call& call) {
    c.traces_light = true; // what is in it is not known, or later
    Request r{call.text(0), call.args[1].strings, call.args[2].floats, call.where, {}};
    // Bindings may give the bound of a world as a multiple of RI_INFINITY: no bound.
    for (const float f : r.bound)
        if (!(std::abs(f) < 1e30f)) {
            r.bound.clear();
            break;
        }
    expand(c, r);
}

void procedural2(Context& c, Call& call) {
    c.traces_light = true; // what is in it is not known, or later
    Request r{call.text(0), {}, {}, call.where, {}};
    if (r.type.ends_with("2"))
        r.type.pop_back();
    if (call.text(1) == "SimpleBound") {
        const Value* bound = call.params.find("__bound");
        if (!bound)
            bound = call.params.find("bound"); // as exporters of RenderMan 20 write it
        if (bound && bound->floats.size() >= 6)
            r.bound.assign(bound->floats.begin(), bound->floats.begin() + 6);
        else
            c.reports.warning("Procedural2", call.where,
                              "Procedural2 \"SimpleBound\" has no \"float[6] __bound\"");
    }
    for (const char* name : {"filename", "__filename", "dsoname", "__dsoname", "programname", "command"})
        if (const std::string file = call.params.get_string(name, ""); !file.empty() && r.arguments.empty())
            r.arguments.push_back(file);
    for (const char* name : {"arguments", "data", "__arguments"})
        if (const std::string text = call.params.get_string(name, "");
            !text.empty() && r.arguments.size() == 1)
            r.arguments.push_back(text);
    r.parameters = call.params;
    // Other parameters reach programs as "name=value" words; plug-ins get them as they are, too.
    if (r.arguments.size() == 1) {
        std::string words;
        for (const Value& v : call.params.values) {
            if (v.name.starts_with("__") || v.name == "filename" || v.name == "dsoname")
                continue;
            words += (words.empty() ? "" : " ") + v.name + "=";
            std::string values;
            for (const float f : v.floats)
                values += (values.empty() ? "" : ",") + std::to_string(f);
            for (const int32_t i : v.ints)
                values += (values.empty() ? "" : ",") + std::to_string(i);
            for (const std::string& s : v.strings)
                values += (values.empty() ? "" : ",") + s;
            words += values;
        }
        if (!words.empty())
            r.arguments.push_back(words);
    }
    expand(c, r);
}

} // namespace kanuka::ingest::handlers
