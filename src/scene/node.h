// Ids that stay: every node of a scene has one, a hash of its path. A path is the parent's path and a name:
// the one that was given, or the number among the parent's nodes of that kind that have none.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace kanuka::scene {

enum class NodeId : uint64_t {
    None = 0,
    World = 1, // the whole scene; what can be set of it are the options
};

// Part of the path: a light and a group of one name are two nodes. Procedural: one that is read on demand,
// the parent of what it makes.
enum class NodeKind : uint8_t { Primitive, Group, Instances, Light, Camera, Shader, Solid, Procedural };
inline constexpr size_t NodeKinds = 8;
std::string_view name(NodeKind kind); // "primitive", …

// How many nodes without a name a parent has had, by kind: the next one's number.
using Unnamed = std::array<uint32_t, NodeKinds>;

NodeId named_node(NodeId parent, NodeKind kind, std::string_view name);
// The second of one path, the third, …
NodeId repeated_node(NodeId first, uint32_t number);
NodeId numbered_node(NodeId parent, NodeKind kind, uint32_t number);
// All places of a group that stand still, or that move at the same times.
NodeId instances_node(NodeId parent, NodeId group, const double* times, size_t count);
NodeId camera_node();

std::string to_text(NodeId id); // "0x0123456789abcdef"

} // namespace kanuka::scene
