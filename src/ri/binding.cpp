#include "ri/binding.h"

#include <algorithm>
#include <cmath>
#include <new>
#ifdef __linux__
#include <cerrno>
#include <sys/uio.h>
#include <unistd.h>
#endif

#include "ingest/rib/requests.h"
#include "ri/contexts.h"
#include "ri/predeclared.h"
#include "ri/session.h"

namespace kanuka::ri {

using ingest::ArgType;
using scene::Type;
using scene::Value;

// ---- arguments --------------------------------------------------------------------------------------

Caller::Caller(Session& session, const char* request) : m_session(session) {
    m_call.spec = ingest::find_request(request);
    m_call.where = session.where();
}

ingest::Argument& Caller::next() {
    ingest::Argument& a = m_call.args[m_argument++];
    a.given = true;
    return a;
}

void Caller::number(double value) {
    next().number = value;
}

void Caller::text(const char* text) {
    ingest::Argument& a = next();
    a.is_text = true;
    a.text = text ? text : "";
}

void Caller::handle(RtPointer pointer) {
    ingest::Argument& a = next();
    const std::string* name = m_session.handle(pointer);
    a.is_text = true;
    if (name) {
        a.text = *name;
        return;
    }
    left_out = true;
    m_session.report(RIE_BADHANDLE, RIE_ERROR,
                     "Ri" + std::string(m_call.spec->name) +
                         " was left out: this handle was returned by no call");
}

void Caller::new_handle(const char* name) {
    ingest::Argument& a = next();
    a.is_text = true;
    a.text = name ? name : std::to_string(m_session.next_handle++);
    result = m_session.keep_handle(a.text);
}

void Caller::filter(RtFilterFunc function) {
    constexpr std::pair<RtFilterFunc, const char*> filters[] = {
        {RiBoxFilter, "box"},           {RiTriangleFilter, "triangle"},
        {RiGaussianFilter, "gaussian"}, {RiCatmullRomFilter, "catmull-rom"},
        {RiSincFilter, "sinc"},         {RiSeparableCatmullRomFilter, "catmull-rom"},
        {RiMitchellFilter, "mitchell"}, {RiBlackmanHarrisFilter, "blackman-harris"}};
    for (const auto& [known, name] : filters)
        if (known == function)
            return text(name);
    if (m_call.spec->name == "PixelFilter" && function) {
        m_own_filter = function;
        return text("table");
    }
    const std::string request = "Ri" + std::string(m_call.spec->name);
    if (!function) {
        m_session.report(RIE_RANGE, RIE_ERROR, request + ": there is no filter; the Gaussian was used");
        return text("gaussian");
    }
    constexpr std::pair<RtFilterFunc, const char*> of_textures[] = {
        {RiBesselFilter, "bessel"}, {RiDiskFilter, "disk"}, {RiLanczosFilter, "lanczos"}};
    for (const auto& [known, name] : of_textures)
        if (known == function)
            return text(name);
    m_session.report(RIE_UNIMPLEMENT, RIE_WARNING,
                     request + ": textures are not made by filters of a program's own; the Gaussian was "
                               "used. There are those of ri.h, RiGaussianFilter and so on");
    text("gaussian");
}

// RIB has no functions: Option "pixelfilter" holds the values in the middle of cells, rows from -y.
void Caller::settle_filter() {
    if (!m_own_filter)
        return;
    constexpr float CellsPerPixel = 32;
    constexpr int Fewest = 16, Most = 192;
    const RtFloat width[2] = {RtFloat(m_call.args[1].number), RtFloat(m_call.args[2].number)};
    int cells[2];
    for (int k = 0; k < 2; k++)
        cells[k] = width[k] > 0 && width[k] < float(Most)
                       ? std::clamp(int(std::ceil(CellsPerPixel * width[k])), Fewest, Most)
                       : Most;
    std::vector<float> values;
    double sum = 0;
    for (int y = 0; y < cells[1]; y++)
        for (int x = 0; x < cells[0]; x++) {
            const auto place = [&](int i, int k) {
                return width[k] * ((RtFloat(i) + 0.5f) / RtFloat(cells[k]) - 0.5f);
            };
            values.push_back(m_own_filter(place(x, 0), place(y, 1), width[0], width[1]));
            sum += double(values.back());
        }
    if (!(sum > 0 && std::isfinite(sum))) {
        m_session.report(
            RIE_RANGE, RIE_ERROR,
            "RiPixelFilter: the integral of a filter must be more than 0; the Gaussian was used");
        m_call.args[0].text = "gaussian";
        return;
    }
    ingest::Call option;
    option.spec = ingest::find_request("Option");
    option.where = m_call.where;
    option.args[0].given = option.args[0].is_text = true;
    option.args[0].text = "pixelfilter";
    Value size;
    size.name = "cells";
    size.type = Type::Integer;
    size.array_size = 2;
    size.ints = std::vector<int32_t>{cells[0], cells[1]};
    Value table;
    table.name = "values";
    table.array_size = int(values.size());
    table.floats = std::move(values);
    option.tokens = {"uniform integer[2] cells",
                     "uniform float[" + std::to_string(table.array_size) + "] values"};
    size.where = table.where = m_call.where;
    option.params.values = {std::move(size), std::move(table)};
    m_session.execute(option);
}

void Caller::floats(const RtFloat* values, long count) {
    if (ingest::Argument& a = next(); values && count > 0)
        a.floats.assign(values, values + count);
}

void Caller::ints(const RtInt* values, long count) {
    if (ingest::Argument& a = next(); values && count > 0)
        a.ints.assign(values, values + count);
}

void Caller::strings(const RtToken* values, long count) {
    ingest::Argument& a = next();
    for (long i = 0; values && i < count; i++)
        a.strings.emplace_back(values[i] ? values[i] : "");
}

// ---- parameters -------------------------------------------------------------------------------------

std::optional<ingest::Declaration> Caller::declaration(const std::string& name) const {
    const ingest::Declarations& declarations = m_session.context().declarations;
    const std::vector<std::string>& own = declarations.own();
    for (size_t i = 0; i < own.size(); i += 2)
        if (own[i] == name)
            return *declarations.find(name);
    std::string problem;
    if (const auto type = predeclared(m_call.spec->name, m_call.args[0].text, name); !type.empty())
        return ingest::parse_declaration(type, false, problem)->declaration;
    if (const ingest::Declaration* known = declarations.find(name))
        return *known;
    return std::nullopt;
}

static std::string declare_it(const std::string& name) {
    const std::string_view type = predeclared_elsewhere(name);
    const std::string mend = "it is not declared, so its length is not known; declare it: ";
    if (!type.empty())
        return mend + "\"" + std::string(type) + " " + name + "\"";
    return mend + "RiDeclare(\"" + name + "\", TYPE), TYPE being \"uniform float\" for a number, " +
           "\"uniform integer\", \"uniform string\", \"uniform color\" or another";
}

// Programs give a text where the address of one belongs, now and then: that must not end them.
static bool readable([[maybe_unused]] const void* place) {
#ifdef __linux__
    char byte;
    const iovec here{&byte, 1}, there{const_cast<void*>(place), 1};
    return process_vm_readv(getpid(), &here, 1, &there, 1, 0) == 1 || errno != EFAULT;
#else
    return true;
#endif
}

void Caller::parameters(RtInt n, const RtToken tokens[], RtPointer parms[], long vertices) {
    const bool primitive = m_call.spec->params == ingest::Params::Primitive;
    const auto& attributes = m_session.context().attributes;
    const Lengths lengths =
        primitive ? lengths_of(m_call, vertices, attributes.u_basis->step, attributes.v_basis->step)
                  : Lengths{};
    for (RtInt i = 0; i < n; i++) {
        const std::string token = tokens[i] ? tokens[i] : "";
        const auto leave_out = [&](const std::string& why) {
            m_session.report(RIE_BADTOKEN, RIE_ERROR,
                             "Ri" + std::string(m_call.spec->name) + ": the parameter \"" + token +
                                 "\" was left out: " + why);
        };
        std::string problem;
        const bool in_line = token.find_first_of(" \t\n[") != std::string::npos;
        const auto parsed = in_line ? ingest::parse_declaration(token, true, problem) : std::nullopt;
        const std::optional<ingest::Declaration> declared = parsed    ? parsed->declaration
                                                            : in_line ? std::nullopt
                                                                      : declaration(token);
        if (!declared || !parms[i]) {
            leave_out(declared ? "it has no value" : in_line ? problem : declare_it(token));
            continue;
        }
        Value v;
        v.name = parsed ? std::string(parsed->name) : token;
        v.type = declared->type;
        v.detail = declared->detail;
        v.array_size = declared->array_size;
        v.where = m_call.where;
        const long items = (primitive ? std::max(lengths.of(v.detail), 0L) : 1) * long(declared->array_size);
        if (v.type == Type::String) {
            const auto* strings = static_cast<const RtToken*>(parms[i]);
            std::vector<std::string> copy;
            bool texts = true;
            for (long k = 0; k < items && texts; k++) {
                texts = primitive || !strings[k] || readable(strings[k]);
                if (texts)
                    copy.emplace_back(strings[k] ? strings[k] : "");
            }
            if (!texts) {
                leave_out("its value is no array of strings; give the address of a char*, not the text");
                continue;
            }
            v.strings = std::move(copy);
        } else if (v.type == Type::Integer) {
            const auto* ints = static_cast<const RtInt*>(parms[i]);
            v.ints = std::vector<int32_t>(ints, ints + items);
        } else {
            const auto* floats = static_cast<const RtFloat*>(parms[i]);
            const long numbers = v.type == scene::Type::Color ? samples() : scene::components(v.type);
            v.floats = std::vector<float>(floats, floats + items * numbers);
        }
        m_call.params.values.push_back(std::move(v));
        m_call.tokens.push_back(token);
    }
}

// ---- calls ------------------------------------------------------------------------------------------

RtPointer make_call(const char* request, const std::function<void(Caller&)>& fill) {
    // Held: callbacks and error handlers of the call may end it.
    const std::shared_ptr<Session> session = current();
    if (!session) {
        report_outside(RIE_NOTSTARTED, RIE_ERROR,
                       std::string("Ri") + request +
                           " was left out: it stands before RiBegin or after RiEnd");
        return nullptr;
    }
    try {
        Caller caller(*session, request);
        fill(caller);
        if (caller.left_out)
            return nullptr;
        caller.settle_filter();
        session->execute(caller.call());
        return caller.result;
    } catch (const std::bad_alloc&) {
        session->report(RIE_NOMEM, RIE_SEVERE, std::string("Ri") + request + ": out of memory");
    } catch (const Error& e) {
        session->report(e.code() == ExitCode::Output ? RIE_SYSTEM : RIE_BADFILE, RIE_SEVERE, e.what());
    } catch (const std::exception& e) {
        session->report(RIE_BUG, RIE_SEVERE, e.what());
    }
    return nullptr;
}

Listed::Listed(std::va_list list) {
    while (const RtToken token = va_arg(list, RtToken)) {
        m_tokens.push_back(token);
        m_values.push_back(va_arg(list, RtPointer));
    }
}

long samples() {
    const std::shared_ptr<Session> session = current();
    if (!session)
        return 3;
    const auto& rgb = session->context().options.rgb_from_samples;
    return rgb.empty() ? 3 : long(rgb.size() / 3);
}

long sum(const RtInt* values, long count) {
    long total = 0;
    for (long i = 0; values && i < count; i++)
        total += std::max(values[i], 0);
    return total;
}

long sum_of_each(const RtInt* values, long records, int stride, int k) {
    long total = 0;
    for (long i = 0; values && i < records; i++)
        total += std::max(values[i * stride + k], 0);
    return total;
}

} // namespace kanuka::ri
