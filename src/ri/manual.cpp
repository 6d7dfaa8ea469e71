// The calls that the table of requests does not make: declarations, options, motion, archives, procedurals.
// Contexts and errors are in contexts.cpp, spaces in spaces.cpp, filters and bases in filters.cpp.

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "ingest/rib/handlers.h"
#include "ingest/rib/view_bound.h"
#include "ri/binding.h"
#include "ri/contexts.h"

namespace kanuka::ri {

namespace {

constexpr int DeepestProcedural = 100;

void make_plain(const char* request) {
    make_call(request, [](Caller&) {});
}

} // namespace

} // namespace kanuka::ri

using namespace kanuka;
using namespace kanuka::ri;

extern "C" {

// ---- declarations, motion, archives -----------------------------------------------------------------

RtToken RiDeclare(RtString name, RtString declaration) {
    if (!current() && name && declaration)
        declare_outside(name, declaration);
    else
        make_call("Declare", [&](Caller& c) {
            c.text(name);
            c.text(declaration);
        });
    return name ? const_cast<RtToken>(keep_token(name)) : RI_NULL;
}

RtVoid RiOptionV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]) {
    if (!current() && option_outside(name, n, tokens, parms))
        return;
    make_call("Option", [&](Caller& c) {
        c.text(name);
        c.parameters(n, tokens, parms, 0);
    });
}

RtVoid RiOption(RtToken name, ...) {
    std::va_list list;
    va_start(list, name);
    Listed a(list);
    va_end(list);
    RiOptionV(name, a.count(), a.tokens(), a.values());
}

// "__handleid" names the object, as in PRMan.
RtObjectHandle RiObjectBeginV(RtInt n, const RtToken tokens[], RtPointer parms[]) {
    const char* name = nullptr;
    for (RtInt i = 0; i < n; i++)
        if (parms[i] && std::string_view(tokens[i] ? tokens[i] : "").ends_with("__handleid"))
            name = *static_cast<RtToken*>(parms[i]);
    return make_call("ObjectBegin", [&](Caller& c) { c.new_handle(name); });
}

RtVoid RiMotionBeginV(RtInt n, RtFloat times[]) {
    make_call("MotionBegin", [&](Caller& c) { c.floats(times, n); });
}

RtVoid RiMotionBegin(RtInt n, ...) {
    std::vector<RtFloat> times;
    std::va_list list;
    va_start(list, n);
    for (RtInt i = 0; i < n; i++)
        times.push_back(RtFloat(va_arg(list, double)));
    va_end(list);
    RiMotionBeginV(RtInt(times.size()), times.data());
}

RtVoid RiReadArchiveV(RtToken name, RtArchiveCallback callback, RtInt n, const RtToken tokens[],
                      RtPointer parms[]) {
    const Session::Listening listening(current(), callback);
    make_call("ReadArchive", [&](Caller& c) {
        c.text(name);
        c.parameters(n, tokens, parms, 0);
    });
}

RtVoid RiReadArchive(RtToken name, RtArchiveCallback callback, ...) {
    std::va_list list;
    va_start(list, callback);
    Listed a(list);
    va_end(list);
    RiReadArchiveV(name, callback, a.count(), a.tokens(), a.values());
}

RtArchiveHandle RiArchiveBeginV(RtToken name, RtInt n, const RtToken tokens[], RtPointer parms[]) {
    make_call("ArchiveBegin", [&](Caller& c) {
        c.text(name);
        c.parameters(n, tokens, parms, 0);
    });
    return current() && name ? current()->keep_handle(name) : nullptr;
}

RtArchiveHandle RiArchiveBegin(RtToken name, ...) {
    std::va_list list;
    va_start(list, name);
    Listed a(list);
    va_end(list);
    return RiArchiveBeginV(name, a.count(), a.tokens(), a.values());
}

RtVoid RiArchiveRecord(RtToken type, RtString format, ...) {
    std::va_list list, again;
    va_start(list, format);
    va_copy(again, list);
    const int length = std::vsnprintf(nullptr, 0, format, list);
    std::string text(size_t(std::max(length, 0)) + 1, '\0');
    std::vsnprintf(text.data(), text.size(), format, again);
    va_end(again);
    va_end(list);
    text.resize(text.size() - 1);
    const std::shared_ptr<Session> session = current();
    if (!session)
        return;
    const std::string_view kind = type ? type : "";
    if (kind == "verbatim")
        return session->verbatim(text);
    // Every line is to be a comment; one that begins so is left as it is.
    const std::string mark = kind == "structure" ? "##" : "#";
    bool first = true;
    for (size_t at = 0; first || at < text.size(); first = false) {
        const size_t stop = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, stop - at);
        session->comment(first || !line.starts_with('#') ? mark + line : line);
        at = stop + 1;
    }
}

// ---- procedurals ------------------------------------------------------------------------------------

// The standard three are requests of RIB, and names; a subdivide function of a program's own may call them.
RtVoid RiProcDelayedReadArchive(RtPointer data, RtFloat) {
    if (data)
        RiReadArchive(*static_cast<RtString*>(data), nullptr, RI_NULL);
}
static void procedural_anywhere(RtPointer data, RtProcSubdivFunc kind) {
    RtBound everywhere = {-RI_INFINITY, RI_INFINITY, -RI_INFINITY, RI_INFINITY, -RI_INFINITY, RI_INFINITY};
    if (data)
        RiProcedural(data, everywhere, kind, nullptr);
}
RtVoid RiProcRunProgram(RtPointer data, RtFloat) {
    procedural_anywhere(data, RiProcRunProgram);
}
RtVoid RiProcDynamicLoad(RtPointer data, RtFloat) {
    procedural_anywhere(data, RiProcDynamicLoad);
}
RtVoid RiProcFree(RtPointer data) {
    std::free(data);
}

RtVoid RiProcedural(RtPointer data, RtBound bound, RtProcSubdivFunc subdivide, RtProcFreeFunc free_data) {
    const char* standard = subdivide == RiProcDelayedReadArchive ? "DelayedReadArchive"
                           : subdivide == RiProcRunProgram       ? "RunProgram"
                           : subdivide == RiProcDynamicLoad      ? "DynamicLoad"
                                                                 : nullptr;
    if (standard) {
        make_call("Procedural", [&](Caller& c) {
            c.text(standard);
            c.strings(static_cast<RtToken*>(data), subdivide == RiProcDelayedReadArchive ? 1 : 2);
            c.floats(bound, 6);
        });
    } else if (const std::shared_ptr<Session> session = current(); session && subdivide) {
        // The program's own: called at once, within the attributes around it.
        if (session->procedural_depth >= DeepestProcedural) {
            session->report(RIE_LIMIT, RIE_ERROR,
                            "RiProcedural was left out: procedurals nest 100 levels deep at most");
        } else {
            Bounds3f b;
            b.extend(Vec3f(bound[0], bound[2], bound[4]));
            b.extend(Vec3f(bound[1], bound[3], bound[5]));
            const ingest::Context& context = session->context();
            const double size = ingest::view_bound(context, b, context.camera_from_current()).area;
            session->procedural_depth++;
            make_plain("AttributeBegin");
            subdivide(data, std::isfinite(size) ? RtFloat(size) : RI_INFINITY);
            session->procedural_depth--;
            if (!session->ended()) {
                const Redirect back(session); // where the function went to another context
                make_plain("AttributeEnd");
            }
        }
    } else {
        make_plain("Procedural"); // says that there is no context
    }
    if (free_data)
        free_data(data);
}

} // extern "C"
