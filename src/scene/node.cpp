#define XXH_INLINE_ALL
#include "scene/node.h"

#include <cstdio>

#include <xxhash.h>

namespace kanuka::scene {

namespace {

// What is hashed of a path besides its names.
struct Step {
    uint64_t parent;
    uint32_t what; // the kind, and how it is told apart
    uint32_t number;
};
static_assert(sizeof(Step) == 16); // no bytes between

enum How : uint32_t { Named = 0x100, Numbered = 0x200, Repeated = 0x300, Placed = 0x400 };

NodeId id_of(uint64_t hash) {
    return NodeId(hash > uint64_t(NodeId::World) ? hash : hash + 2);
}
uint64_t hash(NodeId parent, NodeKind kind, How how, uint32_t number) {
    const Step step{uint64_t(parent), uint32_t(kind) | how, number};
    return XXH3_64bits(&step, sizeof step);
}

} // namespace

std::string_view name(NodeKind kind) {
    constexpr std::string_view names[] = {"primitive", "group",  "instances", "light",
                                          "camera",    "shader", "solid",     "procedural"};
    static_assert(std::size(names) == NodeKinds);
    return names[size_t(kind)];
}

NodeId named_node(NodeId parent, NodeKind kind, std::string_view name) {
    return id_of(XXH3_64bits_withSeed(name.data(), name.size(), hash(parent, kind, Named, 0)));
}
NodeId repeated_node(NodeId first, uint32_t number) {
    return id_of(hash(first, NodeKind(0), Repeated, number));
}
NodeId numbered_node(NodeId parent, NodeKind kind, uint32_t number) {
    return id_of(hash(parent, kind, Numbered, number));
}
NodeId instances_node(NodeId parent, NodeId group, const double* times, size_t count) {
    const uint64_t seed =
        hash(parent, NodeKind::Instances, Placed, 0) ^ hash(group, NodeKind::Instances, Placed, 1);
    return id_of(XXH3_64bits_withSeed(times, count * sizeof *times, seed));
}
NodeId camera_node() {
    return named_node(NodeId::World, NodeKind::Camera, "camera");
}

std::string to_text(NodeId id) {
    char text[20];
    std::snprintf(text, sizeof text, "0x%016llx", static_cast<unsigned long long>(id));
    return text;
}

} // namespace kanuka::scene
