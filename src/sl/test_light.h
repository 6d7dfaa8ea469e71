// Classic surfaces on a plane that is seen from above its middle, and what is said about them.
#pragma once

#include "sl/test_support.h"

namespace kanuka::sl::test {

using grid::LayerOp;
using grid::LobeId;

struct Shaded {
    std::shared_ptr<const Shader> shader;
    std::unique_ptr<Instance> instance;
    grid::VertexInputs out;
    std::string said;

    std::vector<LobeId> lobes() const {
        std::vector<LobeId> l;
        for (const auto& n : instance->program().nodes)
            if (n.op == LayerOp::Lobe)
                l.push_back(n.lobe);
        return l;
    }
    // A slot that is not there reads as -1.
    Vec3f operator()(const char* name, int vertex = 0) const {
        const int s = slot(instance->program(), name);
        return s < 0 ? Vec3f(-1, -1, -1) : value(out, s, vertex);
    }
    int warnings(const char* text) const {
        int n = 0;
        for (size_t at = said.find(text); at != std::string::npos; at = said.find(text, at + 1))
            n++;
        return n;
    }
};

// Shades a plane that is seen from above its middle.
inline Shaded shade(const std::string& source, std::span<const Argument> args = {},
                    GridGlobals globals = {}) {
    Shaded s;
    Journal journal;
    s.shader = compile(source, {}, &journal);
    for (const auto& e : journal.entries())
        if (e.message.find("never used") == std::string::npos)
            s.said += e.where.str() + ": " + e.message + "\n";
    if (!s.shader) {
        ADD_FAILURE() << source << "\n" << s.said;
        s.shader = compile("surface failed() {}");
    }
    TestServices services;
    globals.E = Vec3f(1, 0.5f, 2);
    s.instance = s.shader->instantiate(args, services);
    grid::Grid g = plane(8, 5);
    s.instance->shade(g, globals, services, s.out);
    return s;
}

inline Shaded surface(const std::string& body) {
    return shade("surface s(float Kd = 0.5;) {\n" + body + "\n}");
}

} // namespace kanuka::sl::test
