#include "sl/ops/runtime.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <regex>

#include "sl/ops/host_calls.h"

namespace kanuka::sl::ops {

Location Runner::location(Loc loc) const {
    if (loc.file >= program.files.size())
        return {program.name};
    return {program.files[loc.file], int(loc.line), int(loc.column)};
}

void Runner::report_faults() {
    for (size_t i = 0; i < faults.size(); i++)
        if (faults[i])
            services.report(Severity::Warning, location(stage.faults[i].first),
                            stage.faults[i].second + " (" + std::to_string(faults[i]) + " times)");
}

// ---- textures
// -----------------------------------------------------------------------------------------------------------

static float uniform_value(const Runner& r, const Arguments& a, const char* name, float fallback) {
    for (size_t k = 0; k < a.site.names.size(); k++)
        if (a.site.names[k] == name && r.stage.instrs[size_t(a.site.args[k])].ty == ir::Ty::Float)
            return a.at(int(k))[0][0];
    return fallback;
}

// Arrays for one call, each of a value a vertex.
class VertexArrays {
  public:
    VertexArrays(const Runner& runner, const Arguments& arguments, int count)
        : m_runner(runner), m_arguments(arguments), m_count(count) {}

    int count() const { return m_count; }
    float* make() { return m_buffers.emplace_back(size_t(m_count) + 16, 0.0f).data(); }
    // Component c of argument k.
    const float* argument(int k, int c) {
        const float* p = m_arguments.at(k)[c];
        if (m_runner.stage.instrs[size_t(m_arguments.site.args[size_t(k)])].varying || m_count == 1)
            return p;
        float* b = make();
        std::fill_n(b, m_count, *p);
        return b;
    }
    void differences(const float* x, float scale, const float*& du, const float*& dv) {
        float *p = make(), *o = make();
        if (m_count > 1) {
            difference_u(m_runner, x, p);
            difference_v(m_runner, x, o);
        }
        if (scale != 1)
            for (int i = 0; i < m_count; i++)
                p[i] *= scale, o[i] *= scale;
        du = p;
        dv = o;
    }

  private:
    const Runner& m_runner;
    const Arguments& m_arguments;
    int m_count;
    std::vector<std::vector<float>> m_buffers;
};

// texture(name, s1, t1, … s4, t4): the mean of the four corners, as wide as they are apart.
static void set_corners(TextureRequest& q, VertexArrays& arrays) {
    float *s = arrays.make(), *t = arrays.make(),
          *d[4] = {arrays.make(), arrays.make(), arrays.make(), arrays.make()};
    const float* c[8];
    for (int k = 0; k < 8; k++)
        c[k] = arrays.argument(2 + k, 0);
    for (int i = 0; i < arrays.count(); i++) {
        s[i] = 0.25f * (c[0][i] + c[2][i] + c[4][i] + c[6][i]);
        t[i] = 0.25f * (c[1][i] + c[3][i] + c[5][i] + c[7][i]);
        d[0][i] = 0.5f * (c[2][i] - c[0][i] + c[4][i] - c[6][i]);
        d[1][i] = 0.5f * (c[3][i] - c[1][i] + c[5][i] - c[7][i]);
        d[2][i] = 0.5f * (c[6][i] - c[0][i] + c[4][i] - c[2][i]);
        d[3][i] = 0.5f * (c[7][i] - c[1][i] + c[5][i] - c[3][i]);
    }
    q.s = s, q.t = t, q.dsdu = d[0], q.dtdu = d[1], q.dsdv = d[2], q.dtdv = d[3];
}

// Vertices before the outermost ring of a mesh's patch. Nothing reads what comes of differences there, since
// it has no neighbours to take them from (grid/mesh_patches.h); without a footprint its lookups would fetch
// the finest tiles.
static int before_last_ring(const grid::Stencils& s, int count) {
    while (count > s.own && s.first[size_t(count)] == s.first[size_t(count) - 1])
        count--;
    return count;
}

static void texture(Runner& r, const Frame& frame, const Arguments& a) {
    const ir::Instr& result = r.stage.instrs[size_t(a.site.result)];
    const int n = result.varying ? frame.count : 1;
    VertexArrays arrays(r, a, n);
    TextureRequest q{};
    q.file = a.text(0);
    q.first_channel = int(a.at(1)[0][0]);
    q.count = n;
    q.channels = ir::comps(result.ty);
    q.blur = uniform_value(r, a, "blur",
                           std::max(uniform_value(r, a, "sblur", 0), uniform_value(r, a, "tblur", 0)));
    q.width = uniform_value(r, a, "width", 1);
    q.fill = uniform_value(r, a, "fill", 0);
    q.wrap = q.space = nullptr;
    for (size_t k = 0; k < a.site.names.size(); k++)
        if (a.site.names[k] == "wrap" || a.site.names[k] == "swrap")
            q.wrap = a.text(int(k));
        else if (a.site.names[k] == "colorspace")
            q.space = a.text(int(k));
    q.result = a.result()[0];
    q.result_stride = int(frame.stride);
    if (q.first_channel < 0)
        q.first_channel = 0;
    std::vector<float> contiguous;
    if (!result.varying) { // components of a uniform result lie side by side
        contiguous.resize(3);
        q.result = contiguous.data();
        q.result_stride = 1;
    }
    if (a.site.kind == ir::CallKind::Environment) {
        const float *x = arrays.argument(2, 0), *y = arrays.argument(2, 1), *z = arrays.argument(2, 2);
        q.s = q.t = q.dsdu = q.dtdu = q.dsdv = q.dtdv = arrays.make();
        r.services.environment(q, x, y, z);
    } else if (a.site.args.size() >= 10 && a.site.names[2] == "s1") {
        set_corners(q, arrays);
        r.services.texture(q);
    } else {
        q.s = arrays.argument(2, 0);
        q.t = arrays.argument(3, 0);
        arrays.differences(q.s, uniform_value(r, a, "swidth", 1), q.dsdu, q.dsdv);
        arrays.differences(q.t, uniform_value(r, a, "twidth", 1), q.dtdu, q.dtdv);
        if (r.stencils && n > 1) {
            q.count = before_last_ring(*r.stencils, n);
            for (int c = 0; c < q.channels; c++)
                std::fill(q.result + c * q.result_stride + q.count, q.result + c * q.result_stride + n, 0.0f);
        }
        r.services.texture(q);
    }
    if (!result.varying)
        for (int c = 0; c < q.channels; c++)
            a.result()[c][0] = contiguous[size_t(c)];
}

// ---- strings
// ------------------------------------------------------------------------------------------------------------

// How many of a call's arguments are values: a mask of the lanes that run may come last.
static size_t value_count(const Runner& r, const Arguments& a) {
    const std::vector<ir::Ref>& args = a.site.args;
    return args.size() - (!args.empty() && r.stage.instrs[size_t(args.back())].ty == ir::Ty::Mask);
}

// The vertex whose values are written: the first that runs, -1 = none does.
static int first_active(const Runner& r, const Frame& frame, const Arguments& a) {
    const size_t values = value_count(r, a);
    if (values == a.site.args.size())
        return 0;
    const float* mask = a.at(int(values))[0];
    for (int i = 0; i < frame.count; i++) {
        int32_t bits;
        std::memcpy(&bits, mask + i, 4);
        if (bits < 0)
            return i;
    }
    return -1;
}

static void append_value(std::string& out, const Runner& r, const Arguments& a, int k, int vertex) {
    const ir::Ty ty = r.stage.instrs[size_t(a.site.args[size_t(k)])].ty;
    if (ty == ir::Ty::String) {
        out += a.text(k);
        return;
    }
    if (vertex < 0 || !r.stage.instrs[size_t(a.site.args[size_t(k)])].varying)
        vertex = 0;
    for (int c = 0; c < ir::comps(ty); c++) {
        char number[48];
        std::snprintf(number, sizeof number, "%g", double(a.at(k)[c][vertex]));
        out += (c ? " " : "") + std::string(number);
    }
}

// %f %g %d %c %p %n %v %m %s take the next argument, whatever its type; %% is a percent sign. Widths are
// skipped.
static std::string format(const Runner& r, const Frame& frame, const Arguments& a) {
    const char* p = a.text(0);
    std::string out;
    size_t next = 1;
    const size_t values = value_count(r, a);
    const int vertex = first_active(r, frame, a);
    for (; *p; p++) {
        if (*p != '%') {
            out += *p;
        } else if (p[1] == '%') {
            out += *p++;
        } else {
            while (p[1] && std::strchr("0123456789.-+ ", p[1]))
                p++;
            if (p[1])
                p++;
            if (next < values)
                append_value(out, r, a, int(next++), vertex);
        }
    }
    return out;
}

static float match(const char* pattern, const char* subject) {
    try {
        return std::regex_search(subject, std::regex(pattern, std::regex::extended)) ? 1.0f : 0.0f;
    } catch (const std::regex_error&) {
        return 0;
    }
}

static void space_matrix(Runner& r, const Arguments& a) {
    float m[16];
    const char *from = a.text(0), *to = a.text(1);
    // "" is a shader's way to say "none", asked for under a condition: matrices are fetched before that.
    const bool none = !*from || !*to;
    if (none || !r.services.transform(from, to, m)) {
        if (!none)
            r.services.report(Severity::Warning, r.location(a.site.loc),
                              "unknown coordinate system: no transform from \"" + std::string(from) +
                                  "\" to \"" + to + "\"; nothing is transformed");
        for (int i = 0; i < 16; i++)
            m[i] = i % 5 == 0;
    }
    // Services: p' = M p. The language: p' = p M, so it sees the transpose.
    for (int row = 0; row < 4; row++)
        for (int column = 0; column < 4; column++)
            a.result()[column * 4 + row][0] = m[row * 4 + column];
}

// Found gives 0 or 1, Query the value or zeros.
static void query(Runner& r, const Arguments& a) {
    float floats[16] = {};
    std::string text;
    Query q{};
    q.kind = Query::Kind(a.site.imm / 4);
    const bool texture = q.kind == Query::Texture;
    q.file = texture ? a.text(0) : "";
    q.name = a.text(texture ? 1 : 0);
    static constexpr int Counts[] = {0, 1, 3, 16};
    q.count = Counts[a.site.imm % 4];
    q.wants_text = q.count == 0;
    q.floats = floats;
    q.text = &text;
    const bool found = r.services.query(q);
    if (a.site.kind == ir::CallKind::Found) {
        a.result()[0][0] = found;
    } else if (q.wants_text) {
        a.set_text(r.texts.emplace_back(std::move(text)).c_str());
    } else {
        for (int c = 0; c < q.count; c++)
            a.result()[c][0] = floats[c];
    }
}

// What a light is at points: which one may differ from vertex to vertex, where loops were left early.
static void light(Runner& r, const Frame& frame, const Arguments& a) {
    const ir::Instr& result = r.stage.instrs[size_t(a.site.result)];
    const auto varies = [&](size_t k) { return r.stage.instrs[size_t(a.site.args[k])].varying; };
    const int n = result.varying ? frame.count : 1;
    const size_t pad = size_t(n) + 16;
    std::vector<float> places(3 * pad), out(6 * pad);
    LightRequest q{};
    q.count = n;
    for (size_t c = 0; c < 3; c++) {
        const float* from = a.at(1)[c];
        for (int i = 0; i < n; i++)
            places[c * pad + size_t(i)] = from[varies(1) ? i : 0];
        q.P[c] = places.data() + c * pad;
        q.L[c] = out.data() + c * pad;
        q.Cl[c] = out.data() + (3 + c) * pad;
    }
    const auto wanted = [&](int i) { return int(a.at(0)[0][varies(0) ? i : 0]); };
    const bool color = a.site.kind == ir::CallKind::LightColor;
    for (int k = 0; k < r.services.lights(); k++) {
        bool any = false;
        for (int i = 0; i < n && !any; i++)
            any = wanted(i) == k;
        if (!any)
            continue;
        q.light = k;
        std::fill(out.begin(), out.end(), 0.0f);
        r.services.light(q);
        for (int i = 0; i < n; i++)
            for (size_t c = 0; wanted(i) == k && c < 3; c++)
                a.result()[c][i] = (color ? q.Cl : q.L)[c][i];
    }
}

void host_call(Runner& r, const Frame& frame, const Arguments& a) {
    using ir::CallKind;
    switch (a.site.kind) {
    case CallKind::Dx:
    case CallKind::Dy:
        differences(r, a);
        break;
    case CallKind::CalculateNormal:
        calculate_normal(r, a);
        break;
    case CallKind::Texture:
    case CallKind::Environment:
        texture(r, frame, a);
        break;
    case CallKind::SpaceMatrix:
        space_matrix(r, a);
        break;
    case CallKind::Printf:
        if (first_active(r, frame, a) < 0)
            break;
        r.services.report(Severity::Info, r.location(a.site.loc), format(r, frame, a));
        break;
    case CallKind::Report:
        r.services.report(Severity::Warning, r.location(a.site.loc),
                          std::string(a.text(0)) + " \"" + a.text(1) + "\"");
        break;
    case CallKind::Format:
        a.set_text(r.texts.emplace_back(format(r, frame, a)).c_str());
        break;
    case CallKind::Concat: {
        std::string s;
        const size_t values = value_count(r, a);
        const int vertex = first_active(r, frame, a);
        for (size_t k = 0; k < values; k++)
            append_value(s, r, a, int(k), vertex);
        a.set_text(r.texts.emplace_back(std::move(s)).c_str());
        break;
    }
    case CallKind::Match:
        a.result()[0][0] = match(a.text(0), a.text(1));
        break;
    case CallKind::Found:
    case CallKind::Query:
        query(r, a);
        break;
    case CallKind::Lights:
        a.result()[0][0] = float(r.services.lights());
        break;
    case CallKind::LightDirection:
    case CallKind::LightColor:
        light(r, frame, a);
        break;
    default:
        build_call(r, a);
        break;
    }
}

} // namespace kanuka::sl::ops

// ---- what generated code calls
// --------------------------------------------------------------------------------------------

using kanuka::sl::Frame;
using kanuka::sl::ops::Runner;

extern "C" void kanuka_sl_call(Frame* frame, int32_t site, void** args) {
    Runner& r = *static_cast<Runner*>(frame->host);
    kanuka::sl::ops::host_call(r, *frame, {r.stage, r.stage.calls[size_t(site)], args});
}

extern "C" void kanuka_sl_fault(Frame* frame, int32_t fault, int32_t lanes) {
    Runner& r = *static_cast<Runner*>(frame->host);
    if (r.faults.size() <= size_t(fault))
        r.faults.resize(size_t(fault) + 1);
    r.faults[size_t(fault)] += lanes;
}

extern "C" int32_t kanuka_sl_any(const Frame* frame, const float* mask) {
    for (int i = 0; i < frame->count; i++) {
        int32_t bits;
        std::memcpy(&bits, mask + i, 4);
        if (bits < 0)
            return 1;
    }
    return 0;
}

extern "C" int32_t kanuka_sl_same(const char* a, const char* b) {
    return a == b || std::strcmp(a ? a : "", b ? b : "") == 0; // an array's elements begin as null
}
