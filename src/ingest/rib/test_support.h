// Shared by the RIB tests: parse a text, look at what was reported.
#pragma once

#include <gtest/gtest.h>

#include "ingest/rib/rib.h"

namespace kanuka::ingest::test {

struct Parsed {
    Journal journal;
    scene::Scene scene;

    explicit Parsed(const std::string& text, const RibOptions& options = {}) {
        scene = parse_rib(text, "test.rib", options, journal);
    }
    // Entries as "severity line:column message", sorted.
    std::vector<std::string> messages(Severity least = Severity::Info) const {
        std::vector<std::string> all;
        for (const Journal::Entry& e : journal.entries())
            if (e.severity >= least)
                all.push_back(std::string(e.severity == Severity::Error     ? "error "
                                          : e.severity == Severity::Warning ? "warning "
                                                                            : "info ") +
                              std::to_string(e.where.line) + ":" + std::to_string(e.where.column) + " " +
                              e.message);
        return all;
    }
    std::string all_messages() const {
        std::string s;
        for (const std::string& m : messages())
            s += m + "\n";
        return s;
    }
    bool says(const std::string& text) const { return all_messages().find(text) != std::string::npos; }
    const scene::Primitive& primitive(size_t i) const { return scene.primitives.at(i); }
};

// A world in front of a perspective camera that stands at the origin: world and camera space are the same.
inline std::string world(const std::string& body) {
    return "Projection \"perspective\"\nWorldBegin\n" + body + "\nWorldEnd\n";
}

#define EXPECT_SILENT(parsed) EXPECT_EQ((parsed).all_messages(), "")

inline void expect_point(const Vec3f& p, float x, float y, float z) {
    EXPECT_NEAR(p.x, x, 1e-5f);
    EXPECT_NEAR(p.y, y, 1e-5f);
    EXPECT_NEAR(p.z, z, 1e-5f);
}

} // namespace kanuka::ingest::test
