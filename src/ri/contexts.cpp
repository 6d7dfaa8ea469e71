// Contexts, errors, and what is legal outside of a context.

#include "ri/contexts.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <unistd.h>
#include <vector>

#include "ingest/rib/declarations.h"
#include "ri/binding.h"

namespace kanuka::ri {

namespace {

// The one place that knows which context is current. Never destroyed: handlers may end the program while a
// call is under way.
struct Contexts {
    std::vector<std::shared_ptr<Session>> open;
    std::shared_ptr<Session> current;
    // Before RiBegin:
    RtErrorFunc error_handler = RiErrorPrint; // contexts begin with it
    std::vector<std::pair<std::string, std::string>> declarations;
    Session::Form form;
    bool reporting = false;
    std::set<std::string, std::less<>> tokens;
    const pid_t process = getpid();
};

Contexts& contexts();

// A program that ends without RiEnd; one that was forked leaves the files to its parent.
void abandon_all() {
    Contexts& all = contexts();
    if (getpid() != all.process)
        return;
    for (const auto& session : std::exchange(all.open, {}))
        session->abandon();
}

Contexts& contexts() {
    static Contexts& all = [&]() -> Contexts& {
        std::atexit(abandon_all);
        return *new Contexts;
    }();
    return all;
}

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

} // namespace

std::shared_ptr<Session> current() {
    return contexts().current;
}

Redirect::Redirect(std::shared_ptr<Session> session)
    : m_before(std::exchange(contexts().current, std::move(session))) {}

Redirect::~Redirect() {
    contexts().current = std::move(m_before);
}

void report_outside(RtInt code, RtInt severity, const std::string& message) {
    Contexts& all = contexts();
    RiLastError = code;
    if (!all.error_handler || all.reporting)
        return; // a handler that makes such a call itself would hear of it without end
    std::string text = message;
    all.reporting = true;
    const RtErrorFunc handler = all.error_handler;
    handler(code, severity, text.data());
    all.reporting = false;
}

bool option_outside(const char* name, RtInt n, const RtToken tokens[], RtPointer parms[]) {
    const std::string group = name ? name : "";
    if (group != "rib" && !group.starts_with("RI2RIB"))
        return false;
    Session::Form& form = contexts().form;
    for (RtInt i = 0; i < n; i++) {
        const std::string token = lower(tokens[i] ? tokens[i] : "");
        const std::string key = token.substr(token.find_last_of(' ') + 1);
        const bool asks_form = key == "format" || (key == "type" && group == "RI2RIB_Output");
        if ((!asks_form && key != "compression") || !parms[i] || !*static_cast<RtToken*>(parms[i]))
            continue;
        const std::string value = lower(*static_cast<RtToken*>(parms[i]));
        if (asks_form)
            form.binary = value == "binary";
        else
            form.packing = value == "gzip"   ? ingest::Packing::Gzip
                           : value == "zstd" ? ingest::Packing::Zstd
                                             : ingest::Packing::None;
    }
    return true;
}

void declare_outside(const char* name, const char* declaration) {
    std::string problem;
    if (ingest::parse_declaration(declaration, false, problem))
        contexts().declarations.emplace_back(name, declaration);
    else
        report_outside(RIE_SYNTAX, RIE_ERROR, "RiDeclare \"" + std::string(name) + "\": " + problem);
}

const char* keep_token(const char* text) {
    return contexts().tokens.emplace(text).first->c_str();
}

} // namespace kanuka::ri

using namespace kanuka;
using namespace kanuka::ri;

extern "C" {

RtInt RiLastError = RIE_NOERROR;

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
    const std::shared_ptr<Session> session = current();
    if (!session) {
        contexts().error_handler = handler;
        return;
    }
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
        const auto session = std::make_shared<Session>(name ? name : "", all.form);
        session->error_handler = all.error_handler;
        all.open.push_back(session);
        all.current = session;
        session->say_what_it_does();
        for (const auto& [token, declaration] : all.declarations)
            RiDeclare(const_cast<RtString>(token.c_str()), const_cast<RtString>(declaration.c_str()));
    } catch (const std::exception& e) {
        report_outside(RIE_SYSTEM, RIE_SEVERE, e.what());
    }
}

RtVoid RiEnd(void) {
    Contexts& all = contexts();
    const std::shared_ptr<Session> session = all.current;
    if (!session) {
        RiLastError = RIE_NOTSTARTED;
        return;
    }
    if (session->records()) {
        session->report(RIE_NESTING, RIE_ERROR,
                        "RiEnd stands in a procedural's library, which did not begin the context");
        return;
    }
    // First: a handler that hears of what finish() finds, and calls RiEnd, finds no context to end.
    std::erase(all.open, session);
    all.current = nullptr;
    try {
        session->finish();
    } catch (const std::exception& e) {
        session->report(RIE_SYSTEM, RIE_SEVERE, e.what());
    }
}

RtContextHandle RiGetContext(void) {
    return current().get();
}

RtVoid RiContext(RtContextHandle handle) {
    Contexts& all = contexts();
    for (const auto& session : all.open)
        if (session.get() == handle) {
            all.current = session;
            return;
        }
    if (!handle) // as RiGetContext() gave it
        all.current = nullptr;
    else
        report_outside(RIE_BADHANDLE, RIE_ERROR, "RiContext: no open context has this handle");
}

RtVoid RiSynchronize(RtToken) {}

} // extern "C"
