// The calls that the table of requests does not make: contexts, errors, declarations, motion, archives,
// procedurals, filters, bases.

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "ingest/rib/handlers.h"
#include "ingest/rib/view_bound.h"
#include "ri/binding.h"
#include "ri/session.h"

namespace kanuka::ri {

namespace {

// The interface itself is global: RISpec's calls name no context. This is the one place that knows which is
// current.
struct Contexts {
    std::vector<std::unique_ptr<Session>> open;
    Session* current = nullptr;
};

Contexts& contexts() {
    static Contexts all;
    return all;
}

constexpr int DeepestProcedural = 100;
constexpr float Pi = 3.14159265358979f;

float sinc(float x) {
    return std::abs(x) < 1e-4f ? 1 : std::sin(Pi * x) / (Pi * x);
}

float bessel(float r) { // J1(pi r) / (pi r / 2): the disc's counterpart of sinc
    return r < 1e-3f ? 1 : float(std::cyl_bessel_j(1.0, double(Pi * r))) / (0.5f * Pi * r);
}

float catmull_rom(float x) {
    x = std::abs(x);
    return x < 1 ? (1.5f * x - 2.5f) * x * x + 1 : x < 2 ? ((-0.5f * x + 2.5f) * x - 4) * x + 2 : 0;
}

float mitchell(float x) { // B = C = 1/3 over [-2, 2]
    x = std::abs(x);
    if (x < 1)
        return (7 * x * x * x - 12 * x * x + 16.0f / 3) / 6;
    return x < 2 ? (-7.0f / 3 * x * x * x + 12 * x * x - 20 * x + 32.0f / 3) / 6 : 0;
}

float blackman_harris(float x) { // over [-1/2, 1/2]
    if (std::abs(x) > 0.5f)
        return 0;
    const float t = 2 * Pi * (x + 0.5f);
    return 0.35875f - 0.48829f * std::cos(t) + 0.14128f * std::cos(2 * t) - 0.01168f * std::cos(3 * t);
}

void make_plain(const char* request) {
    make_call(request, [](Caller&) {});
}

} // namespace

Session* current() {
    return contexts().current;
}

Redirect::Redirect(Session& session) : m_before(contexts().current) {
    contexts().current = &session;
}
Redirect::~Redirect() {
    contexts().current = m_before;
}

} // namespace kanuka::ri

using namespace kanuka;
using namespace kanuka::ri;

extern "C" {

RtInt RiLastError = RIE_NOERROR;

RtBasis RiBezierBasis = {{-1, 3, -3, 1}, {3, -6, 3, 0}, {-3, 3, 0, 0}, {1, 0, 0, 0}};
RtBasis RiBSplineBasis = {{-1.f / 6, 3.f / 6, -3.f / 6, 1.f / 6},
                          {3.f / 6, -6.f / 6, 3.f / 6, 0},
                          {-3.f / 6, 0, 3.f / 6, 0},
                          {1.f / 6, 4.f / 6, 1.f / 6, 0}};
RtBasis RiCatmullRomBasis = {
    {-0.5f, 1.5f, -1.5f, 0.5f}, {1, -2.5f, 2, -0.5f}, {-0.5f, 0, 0.5f, 0}, {0, 1, 0, 0}};
RtBasis RiHermiteBasis = {{2, 1, -2, 1}, {-3, -2, 3, -1}, {0, 1, 0, 0}, {1, 0, 0, 0}};
RtBasis RiPowerBasis = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};

// ---- errors -----------------------------------------------------------------------------------------

RtVoid RiErrorIgnore(RtInt, RtInt, char*) {}

RtVoid RiErrorPrint(RtInt code, RtInt severity, char* message) {
    static constexpr const char* names[] = {"info", "warning", "error", "severe error"};
    const char* name = names[std::clamp(severity, 0, 3)];
    if (code == RIE_NOERROR)
        std::fprintf(stderr, "%s: %s\n", name, message);
    else
        std::fprintf(stderr, "%s: %s (RIE %d)\n", name, message, code);
}

RtVoid RiErrorAbort(RtInt code, RtInt severity, char* message) {
    RiErrorPrint(code, severity, message);
    if (severity >= RIE_ERROR)
        std::exit(1);
}

RtVoid RiErrorHandler(RtErrorFunc handler) {
    Session* session = current();
    if (!session)
        return make_plain("ErrorHandler"); // says that there is no context
    session->error_handler = handler;
    if (session->writes())
        make_call("ErrorHandler", [&](Caller& c) {
            c.text(handler == RiErrorIgnore ? "ignore" : handler == RiErrorAbort ? "abort" : "print");
        });
}

// ---- contexts ---------------------------------------------------------------------------------------

RtVoid RiBegin(RtToken name) {
    Contexts& all = contexts();
    try {
        all.open.push_back(std::make_unique<Session>(name ? name : ""));
        all.current = all.open.back().get();
    } catch (const std::exception& e) {
        RiLastError = RIE_SYSTEM;
        std::string message = e.what();
        RiErrorPrint(RIE_SYSTEM, RIE_SEVERE, message.data());
    }
}

RtVoid RiEnd(void) {
    Contexts& all = contexts();
    if (!all.current) {
        RiLastError = RIE_NOTSTARTED;
        return;
    }
    try {
        all.current->finish();
    } catch (const std::exception& e) {
        all.current->report(RIE_SYSTEM, RIE_SEVERE, e.what());
    }
    std::erase_if(all.open, [&](const auto& session) { return session.get() == all.current; });
    all.current = nullptr;
}

RtContextHandle RiGetContext(void) {
    return current();
}

RtVoid RiContext(RtContextHandle handle) {
    Contexts& all = contexts();
    for (const auto& session : all.open)
        if (session.get() == handle) {
            all.current = session.get();
            return;
        }
    RiLastError = RIE_BADHANDLE;
    char message[] = "RiContext: no open context has this handle";
    RiErrorPrint(RIE_BADHANDLE, RIE_ERROR, message);
}

// ---- declarations, motion, archives -----------------------------------------------------------------

RtToken RiDeclare(RtString name, RtString declaration) {
    make_call("Declare", [&](Caller& c) {
        c.text(name);
        c.text(declaration);
    });
    return current() && name ? const_cast<RtToken>(current()->keep_token(name)) : RI_NULL;
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

RtVoid RiReadArchiveV(RtToken name, RtArchiveCallback callback, RtInt n, RtToken tokens[],
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

RtArchiveHandle RiArchiveBeginV(RtToken name, RtInt n, RtToken tokens[], RtPointer parms[]) {
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
    const std::string kind = type ? type : "";
    if (!current())
        return;
    std::ranges::replace(text, '\n', ' ');
    current()->comment(kind == "structure" ? "##" + text : kind == "verbatim" ? text : "#" + text);
}

// From one named space to another; null where one of them is not known.
RtPoint* RiTransformPoints(RtToken from, RtToken to, RtInt n, RtPoint points[]) {
    Session* session = current();
    if (!session)
        return nullptr;
    const auto& spaces = session->context().coordinate_systems;
    const auto place = [&](const char* name) -> std::optional<Transform> {
        const std::string space = name ? name : "";
        if (space == "object" || space == "shader" || space == "current")
            return session->context().ctm;
        if (const auto known = spaces.find(space); known != spaces.end())
            return known->second;
        return std::nullopt;
    };
    const auto a = place(from), b = place(to);
    if (!a || !b) {
        session->report(RIE_RANGE, RIE_ERROR, "RiTransformPoints: a space is not known here");
        return nullptr;
    }
    try {
        const Transform to_from = b->inverse() * *a;
        for (RtInt i = 0; i < n; i++) {
            const Vec3f p = to_from.point({points[i][0], points[i][1], points[i][2]});
            points[i][0] = p.x, points[i][1] = p.y, points[i][2] = p.z;
        }
    } catch (const Error& e) {
        session->report(RIE_MATH, RIE_ERROR, e.what());
        return nullptr;
    }
    return points;
}

// ---- procedurals ------------------------------------------------------------------------------------

// The standard three are requests of RIB; called as functions by nobody, they are names.
RtVoid RiProcDelayedReadArchive(RtPointer, RtFloat) {}
RtVoid RiProcRunProgram(RtPointer, RtFloat) {}
RtVoid RiProcDynamicLoad(RtPointer, RtFloat) {}
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
    } else if (Session* session = current(); session && subdivide) {
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
            make_plain("AttributeEnd");
            session->procedural_depth--;
        }
    } else {
        make_plain("Procedural"); // says that there is no context
    }
    if (free_data)
        free_data(data);
}

// ---- filters ----------------------------------------------------------------------------------------

RtFloat RiBoxFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return std::abs(x) <= xw / 2 && std::abs(y) <= yw / 2 ? 1 : 0;
}
RtFloat RiTriangleFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return std::max(0.0f, 1 - 2 * std::abs(x) / xw) * std::max(0.0f, 1 - 2 * std::abs(y) / yw);
}
RtFloat RiCatmullRomFilter(RtFloat x, RtFloat y, RtFloat, RtFloat) {
    return catmull_rom(x) * catmull_rom(y);
}
RtFloat RiSincFilter(RtFloat x, RtFloat y, RtFloat, RtFloat) {
    return sinc(x) * sinc(y);
}
RtFloat RiBesselFilter(RtFloat x, RtFloat y, RtFloat, RtFloat) {
    return bessel(std::hypot(x, y));
}
RtFloat RiGaussianFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    x *= 2 / xw;
    y *= 2 / yw;
    return std::exp(-2 * (x * x + y * y));
}
RtFloat RiMitchellFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return mitchell(4 * x / xw) * mitchell(4 * y / yw);
}
RtFloat RiBlackmanHarrisFilter(RtFloat x, RtFloat y, RtFloat xw, RtFloat yw) {
    return blackman_harris(x / xw) * blackman_harris(y / yw);
}

} // extern "C"
