// Blocks, archives, conditions.

#include <cstdlib>
#include <sys/wait.h>

#include "ingest/rib/condition.h"
#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"

namespace kanuka::ingest::handlers {

void declare(Context& c, Call& call) {
    std::string problem;
    const auto parsed = parse_declaration(call.text(1), false, problem);
    if (!parsed || !parsed->name.empty()) {
        c.reports.error(
            "Declare", call.where,
            "Declare \"" + call.text(0) + "\" was left out: " +
                (parsed ? "the declaration \"" + call.text(1) + "\" must not hold a name" : problem));
        return;
    }
    c.declarations.declare(call.text(0), parsed->declaration, call.text(1));
}

void frame_begin(Context& c, Call& call) {
    c.begin_frame(call.i(0), call.where);
}
void frame_end(Context& c, Call& call) {
    c.end_frame(call.where);
}
void world_begin(Context& c, Call& call) {
    c.begin_world(call.where);
}
void world_end(Context& c, Call& call) {
    c.end_world(call.where);
}
void attribute_begin(Context& c, Call& call) {
    c.open(BlockKind::Attribute, call.where);
}
void attribute_end(Context& c, Call& call) {
    c.close(BlockKind::Attribute, call.where);
}
void transform_begin(Context& c, Call& call) {
    c.open(BlockKind::Transform, call.where);
}
void transform_end(Context& c, Call& call) {
    c.close(BlockKind::Transform, call.where);
}

void solid_begin(Context& c, Call& call) {
    const std::string& operation = call.text(0);
    if (operation != "primitive" && operation != "union" && operation != "intersection" &&
        operation != "difference")
        c.reports.error("SolidBegin", call.where,
                        "SolidBegin \"" + operation +
                            "\": it must be primitive, union, intersection or difference");
    c.open(BlockKind::Solid, call.where);
    using Kind = scene::Solid::Kind;
    const Kind kind = operation == "union"          ? Kind::Union
                      : operation == "intersection" ? Kind::Intersection
                      : operation == "difference"   ? Kind::Difference
                                                    : Kind::Primitive;
    c.attributes.solid = c.add_solid({kind, c.attributes.solid});
}
void solid_end(Context& c, Call& call) {
    c.close(BlockKind::Solid, call.where);
}

void object_begin(Context& c, Call& call) {
    c.begin_object(call.handle(0), call.where);
}
void object_end(Context& c, Call& call) {
    c.end_object(call.where);
}
void object_instance(Context& c, Call& call) {
    c.add_instance(call);
}

void motion_begin(Context& c, Call& call) {
    c.begin_motion(call);
}
void motion_end(Context& c, Call& call) {
    c.end_motion(call.where);
}

void read_archive(Context& c, Call& call) {
    c.stream.read_archive(call.text(0), call.where);
}
void archive_begin(Context& c, Call& call) {
    c.stream.record_archive(call.text(0));
}

void archive_end(Context& c, Call& call) {
    c.reports.error("unmatched ArchiveEnd", call.where, "ArchiveEnd without ArchiveBegin was left out");
}

// ---- conditions -------------------------------------------------------------------------------------

static bool holds(Context& c, const Call& call) {
    std::string problem;
    const bool result = evaluate_condition(call.text(0), c, problem);
    if (!problem.empty())
        c.reports.error("condition", call.where,
                        std::string(call.spec->name) + " \"" + call.text(0) + "\": " + problem +
                            "; taken as false");
    return result && problem.empty();
}

static void enter(Context& c, bool take) {
    if (take)
        c.conditions.back() = true;
    else
        c.stream.skip_to("IfBegin", {"ElseIf", "Else", "IfEnd"});
}

static bool inside_if(Context& c, const Call& call) {
    if (!c.conditions.empty())
        return true;
    c.reports.error("unmatched " + std::string(call.spec->name), call.where,
                    std::string(call.spec->name) + " without IfBegin was left out");
    return false;
}

void if_begin(Context& c, Call& call) {
    c.conditions.push_back(false);
    enter(c, holds(c, call));
}

void else_if(Context& c, Call& call) {
    if (inside_if(c, call))
        enter(c, !c.conditions.back() && holds(c, call));
}

void else_branch(Context& c, Call& call) {
    if (inside_if(c, call))
        enter(c, !c.conditions.back());
}

void if_end(Context& c, Call& call) {
    if (inside_if(c, call))
        c.conditions.pop_back();
}

// ---- commands, errors, resources, edits
// ---------------------------------------------------------------------

void system_command(Context& c, Call& call) {
    const std::string& command = call.text(0);
    if (!c.rib_options.run_system) {
        c.reports.once(
            Severity::Warning, "System", call.where,
            "System \"" + command +
                "\" was not run: a scene may run commands only if who reads it allows it, by kanuka "
                "render --allow-system or kanuka.load(..., run_system=True)");
        return;
    }
    const int status = std::system(command.c_str());
    if (status == -1)
        c.reports.error("System", call.where, "System \"" + command + "\" could not be started");
    else if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        c.reports.warning("System", call.where,
                          "System \"" + command + "\" ended with " +
                              (WIFEXITED(status) ? "status " + std::to_string(WEXITSTATUS(status))
                                                 : "signal " + std::to_string(WTERMSIG(status))));
}

void error_handler(Context& c, Call& call) {
    const std::string& mode = call.text(0);
    using Mode = Reports::Mode;
    if (mode == "print" || mode == "ignore" || mode == "abort")
        c.reports.mode = mode == "print" ? Mode::Print : mode == "ignore" ? Mode::Ignore : Mode::Abort;
    else
        c.reports.error("ErrorHandler", call.where,
                        "ErrorHandler \"" + mode +
                            "\": it must be print, ignore or abort; it stays as it was");
}

void resource_begin(Context& c, Call&) {
    c.resources.emplace_back();
}

void resource_end(Context& c, Call& call) {
    if (c.resources.size() > 1)
        c.resources.pop_back();
    else
        c.reports.error("unmatched ResourceEnd", call.where,
                        "ResourceEnd without ResourceBegin was left out");
}

void resource(Context& c, Call& call) {
    const std::string &handle = call.text(0), &type = call.text(1);
    const std::string operation = call.params.get_string("operation", "save");
    const std::string subset = call.params.get_string("subset", "all");
    if (type != "attributes" || (operation != "save" && operation != "restore")) {
        c.reports.once(Severity::Warning, "Resource " + type + " " + operation, call.where,
                       "Resource \"" + type + "\" \"" + operation +
                           "\" was left out: there is \"attributes\" with the operations save and restore");
        return;
    }
    if (operation == "save") {
        c.resources.back()[handle] = {c.attributes, c.ctm, c.ctm_keys};
        return;
    }
    for (auto scope = c.resources.rbegin(); scope != c.resources.rend(); ++scope) {
        const auto found = scope->find(handle);
        if (found == scope->end())
            continue;
        const bool all = subset.find("all") != std::string::npos;
        if (all || subset.find("shading") != std::string::npos)
            c.attributes = found->second.attributes;
        if (all || subset.find("transform") != std::string::npos) {
            c.ctm = found->second.ctm;
            c.ctm_keys = found->second.ctm_keys;
        }
        return;
    }
    c.reports.error("unknown resource", call.where,
                    "Resource \"" + handle +
                        "\" cannot be restored: nothing was saved under this name in the open blocks");
}

void edit_begin(Context& c, Call& call) {
    c.reports.once(
        Severity::Warning, "EditBegin", call.where,
        "EditBegin … EditEnd was passed over: it changes a render that is running already; put the "
        "change into the scene");
    c.stream.skip_to("EditBegin", {"EditEnd"});
}

} // namespace kanuka::ingest::handlers
