// What tests of surfaces share.
#pragma once

#include <gtest/gtest.h>

#include "geom/surface.h"
#include "scene/test_values.h"

namespace kanuka::geom::testing {

using scene::Detail;
using scene::Type;
using scene::testing::value;

inline scene::Primitive primitive(scene::Geometry g, std::vector<float> p) {
    scene::Primitive out;
    out.geometry = std::move(g);
    if (!p.empty())
        out.primvars.set(value("P", scene::Type::Point, scene::Detail::Vertex, std::move(p)));
    return out;
}

inline grid::Grid evaluate(const Surface& s, int face, const std::vector<float>& u,
                           const std::vector<float>& v) {
    grid::Grid g;
    g.allocate(int(u.size()) - 1, int(v.size()) - 1);
    s.allocate_channels(g);
    s.evaluate(face, {u.data(), int(u.size())}, {v.data(), int(v.size())}, {g, 0, g.nu + 1});
    return g;
}

inline grid::Grid evaluate(const Surface& s, int face, int n = 16) {
    std::vector<float> t(n + 1);
    for (int i = 0; i <= n; i++)
        t[i] = float(i) / float(n);
    return evaluate(s, face, t, t);
}

inline std::unique_ptr<Surface> make(const scene::Primitive& p, const Transform& m = {}) {
    Journal journal;
    auto s = make_surface(p, m, journal);
    EXPECT_TRUE(journal.entries().empty()) << journal.entries()[0].message;
    return s;
}

} // namespace kanuka::geom::testing
