// What the tests of the compiler share: services that record, grids with a known shape, compiling without a
// cache.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <mutex>
#include <span>

#include "base/cpu.h"
#include "sl/sl.h"

namespace kanuka::sl::test {

class TestServices : public Services {
  public:
    std::vector<std::string> reports;
    std::mutex mutex;
    int textures = 0;
    bool footprints_finite = true;

    // A texture is (s, t, 0.25); a file "missing.tx" is not there.
    void texture(const TextureRequest& q) override {
        textures++;
        for (int i = 0; i < q.count; i++) {
            const float value[3] = {q.s[i], q.t[i], 0.25f};
            for (int c = 0; c < q.channels; c++)
                q.result[c * q.result_stride + i] =
                    c + q.first_channel < 3 ? value[c + q.first_channel] : q.fill;
            footprints_finite =
                footprints_finite && std::isfinite(q.dsdu[i] + q.dsdv[i] + q.dtdu[i] + q.dtdv[i]);
        }
        if (std::strcmp(q.file, "missing.tx") == 0)
            report(Severity::Warning, {}, "cannot read missing.tx");
    }
    void environment(const TextureRequest& q, const float* x, const float* y, const float* z) override {
        for (int i = 0; i < q.count; i++) {
            const float value[3] = {x[i], y[i], z[i]};
            for (int c = 0; c < q.channels; c++)
                q.result[c * q.result_stride + i] = value[c];
        }
    }
    // "shifted" lies at (1, 2, 3) in current space, "scaled" is twice as large.
    bool transform(const char* from, const char* to, float m[16]) override {
        const auto current = [](const std::string& s, float scale_shift[4]) {
            const float identity[4] = {1, 0, 0, 0}, shifted[4] = {1, 1, 2, 3}, scaled[4] = {2, 0, 0, 0};
            const float* k = s == "shifted" ? shifted : s == "scaled" ? scaled : identity;
            std::copy(k, k + 4, scale_shift);
            return s == "current" || s == "shader" || s == "object" || s == "world" || s == "camera" ||
                   s == "shifted" || s == "scaled";
        };
        float a[4], b[4]; // current = s x + t for both
        if (!current(from, a) || !current(to, b))
            return false;
        for (int i = 0; i < 16; i++)
            m[i] = i == 15 ? 1 : 0;
        for (int i = 0; i < 3; i++) {
            m[i * 4 + i] = a[0] / b[0];
            m[i * 4 + 3] = (a[i + 1] - b[i + 1]) / b[0];
        }
        return true;
    }
    // It knows user:age, the name of the renderer, and that textures have 64 x 32 texels.
    bool query(const Query& q) override {
        const std::string name = q.name;
        if (q.kind == Query::Renderer && name == "renderer" && q.wants_text)
            *q.text = "test";
        else if (q.kind == Query::Attribute && name == "user:age" && !q.wants_text)
            q.floats[0] = 41;
        else if (q.kind == Query::Texture && name == "resolution" && q.count >= 2) {
            q.floats[0] = 64;
            q.floats[1] = 32;
        } else
            return false;
        return true;
    }
    void report(Severity, const Location& where, const std::string& message) override {
        const std::lock_guard lock(mutex);
        reports.push_back(where.str() + ": " + message);
    }
};

// (nu + 1) x (nv + 1) vertices of the plane z = 0 over [0, 2] x [0, 1], normals up. nv = 0: a cloud.
inline grid::Grid plane(int nu, int nv) {
    grid::Grid g;
    g.allocate(nu, nv);
    for (int j = 0; j <= nv; j++)
        for (int i = 0; i <= nu; i++) {
            const int k = j * (nu + 1) + i;
            const float u = nu ? float(i) / float(nu) : 0, v = nv ? float(j) / float(nv) : 0;
            g.u[k] = g.s[k] = u;
            g.v[k] = g.t[k] = v;
            g.P[k] = 2 * u;
            g.P[g.stride + k] = v;
            g.N[2 * g.stride + k] = g.Ng[2 * g.stride + k] = 1;
            g.dPdu[k] = 2;
            g.dPdv[g.stride + k] = 1;
        }
    return g;
}

inline std::string messages(const Journal& journal) {
    std::string all;
    for (const auto& e : journal.entries())
        all += e.where.str() + ": " + e.message + "\n";
    return all;
}

struct Config {
    int lanes = 8, opt = 2;
};

inline std::vector<Config> configs() {
    std::vector<Config> c = {{1, 0}, {1, 2}, {8, 0}, {8, 2}};
    if (has_avx512()) {
        c.push_back({16, 0});
        c.push_back({16, 2});
    }
    return c;
}

inline std::shared_ptr<const Shader> compile(const std::string& source, Config c = {},
                                             Journal* journal = nullptr) {
    Journal own;
    Journal& j = journal ? *journal : own;
    CompileOptions o;
    o.lanes = c.lanes;
    o.opt_level = c.opt;
    o.use_cache = false;
    auto s = compile_source("test.sl", source, o, j);
    if (!s && !journal)
        ADD_FAILURE() << messages(j);
    return s;
}

// The index of a slot by its name, -1 = none.
inline int slot(const grid::LayeringProgram& p, const std::string& name) {
    for (size_t i = 0; i < p.slots.size(); i++)
        if (p.slots[i].name == name)
            return int(i);
    return -1;
}

// A slot's value at a vertex.
inline Vec3f value(const grid::VertexInputs& in, int slot, int vertex) {
    const grid::SlotValues& s = in.slots[size_t(slot)];
    if (s.uniform)
        return s.value;
    const size_t n = size_t(in.stride);
    const size_t v = size_t(vertex);
    return s.data.size() >= 3 * n ? Vec3f(s.data[v], s.data[n + v], s.data[2 * n + v])
                                  : Vec3f(s.data[v], 0, 0);
}

// A shader that runs `statements`, which leave a color in r; `before` stands outside of it (functions).
inline std::string probe(const std::string& statements, const std::string& before = {},
                         const std::string& parameters = {}) {
    return before + "\nclass probe(" + parameters + R"() {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary boundary = CreateBoundary(m);
        AddLobe(boundary, "plus", DiffuseEmission());
        AddLobe(boundary, "minus", DiffuseEmission());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary) {
        color r = 0;
        )" +
           statements + R"(
        SetLobe(boundary, "plus", 1, DiffuseEmission("radiance", r));
        SetLobe(boundary, "minus", 1, DiffuseEmission("radiance", -r));
    }
})";
}

// What the probe leaves in r at every vertex, negative values too.
inline std::vector<Vec3f> run_probe(const Shader& shader, grid::Grid& g, TestServices& services,
                                    std::span<const Argument> arguments = {},
                                    const GridGlobals& globals = {}) {
    const auto instance = shader.instantiate(arguments, services);
    grid::VertexInputs out;
    instance->shade(g, globals, services, out);
    const int plus = slot(instance->program(), "plus.radiance"),
              minus = slot(instance->program(), "minus.radiance");
    std::vector<Vec3f> r;
    for (int i = 0; i < g.vertices(); i++)
        r.push_back(value(out, plus, i) - value(out, minus, i));
    return r;
}

// r after the statements, on an 9 x 5 plane, at every lane count and optimisation; they must agree.
inline std::vector<Vec3f> evaluate(const std::string& statements, const std::string& before = {},
                                   float tolerance = 4e-6f, TestServices* given = nullptr) {
    std::vector<Vec3f> first;
    for (const Config c : configs()) {
        TestServices own;
        TestServices& services = given ? *given : own;
        const auto shader = compile(probe(statements, before), c);
        if (!shader)
            return std::vector<Vec3f>(54, Vec3f(NAN, NAN, NAN));
        grid::Grid g = plane(8, 5);
        const std::vector<Vec3f> r = run_probe(*shader, g, services);
        if (first.empty())
            first = r;
        for (size_t i = 0; i < r.size(); i++)
            for (int k = 0; k < 3; k++)
                EXPECT_NEAR(r[i][k], first[i][k], tolerance * std::max(1.0f, std::abs(first[i][k])))
                    << statements << " vertex " << i << " lanes " << c.lanes << " O" << c.opt;
    }
    return first;
}

} // namespace kanuka::sl::test
