// Procedurals that wait until somebody needs them: what must be known to expand each as if it were read where
// it stands, in about 300 bytes.
#pragma once

#include <deque>
#include <memory>

#include "ingest/rib/state.h"
#include "scene/delayed.h"

namespace kanuka::ingest {

class Context;
class Reader;
class Source;

// A Procedural request.
struct ProceduralCall {
    std::string type; // DelayedReadArchive, RunProgram, DynamicLoad, or a plug-in's own
    std::vector<std::string> arguments;
    std::vector<float> bound; // may be empty
    Location where;           // copies: what is expanded reuses the call
    scene::ValueList parameters = {};
};

class OnDemand final : public scene::Delayed {
  public:
    OnDemand();
    ~OnDemand() override;
    // Keeps the procedural; `world` is its bound.
    void add(const ProceduralCall& call, const Context& context, const Bounds3f& world);
    // Whose context expands them: it lives on with its world open.
    void take(std::shared_ptr<Reader> reader, std::shared_ptr<const Source> source);

  private:
    // What many have in common.
    struct State {
        std::shared_ptr<const scene::Attributes> before; // as the requests had made them
        AttributeState attributes;                       // and with the lights that are on
        std::string type;
        FileName file;
    };
    struct Item {
        std::shared_ptr<const State> state;
        std::array<double, 12> ctm;
        std::vector<std::string> arguments;
        std::unique_ptr<const scene::ValueList> parameters;
        std::array<float, 6> bound;
        int line, column, depth;
        scene::NodeId node; // what it makes is named under it
    };
    scene::Scene expand(std::span<const uint32_t> which) override;

    std::deque<Item> m_items;
    std::shared_ptr<const State> m_last;
    std::shared_ptr<const Source> m_source; // keeps what the reader points to
    std::shared_ptr<Reader> m_reader;
    int m_depth = 0; // of procedurals that expand() is in
    // Whose procedurals are being read, and how many it has brought.
    scene::NodeId m_parent = scene::NodeId::World;
    uint32_t m_brought = 0;
};

namespace handlers {
// Expands it here and now.
void expand_procedural(Context& context, const ProceduralCall& call);
} // namespace handlers

} // namespace kanuka::ingest
