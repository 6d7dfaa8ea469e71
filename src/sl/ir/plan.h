// How a stage runs over a grid: straight loops over all vertices (regions), split where an operation needs
// its operands at all vertices first (derivatives, textures) or the host. What lives across a split is kept
// in the frame: an array of one value a vertex, or one value a grid.
//
//   root   ┌ region 0 ┐ call Dx ┌ region 1 ┐ if (uniform) { call Texture  ┌ region 2 ┐ } ┌ region 3: outputs
//   ┐
//
// The plan depends on the IR alone, so cached machine code and the host agree on the frame.
#pragma once

#include <unordered_map>
#include <unordered_set>

#include "sl/ir/passes.h"

namespace kanuka::sl::ir {

struct Slot {
    enum Kind : uint8_t { Local, Uniform, Text, Array } kind = Local;
    int index = -1; // of its first component
};

struct Plan {
    std::vector<Slot> refs, vars;
    int uniforms = 0, texts = 0, arrays = 0; // size of the frame
    std::unordered_set<const Item*> grid;    // items that do not fit into a region
    std::unordered_set<const Item*> first;   // where a region begins; it runs up to the next split
    bool outputs_apart = false;              // the last region writes outputs and nothing else
    int regions = 0;
    bool is_grid(const Item& i) const { return grid.count(&i) > 0; }
};

// Instructions in one region at most, so that no function grows beyond what a code generator does in linear
// time.
inline constexpr int RegionLimit = 1500;
// Cost of an item in instructions, all nested ones counted.
int item_size(const Item& item);

Plan make_plan(const Stage& stage);

inline bool is_leaf(Op op) {
    return op <= Op::Channel;
}

} // namespace kanuka::sl::ir
