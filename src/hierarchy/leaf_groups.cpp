#include "hierarchy/leaf_groups.h"

#include <vector>

#include "base/tasks.h"

namespace kanuka::hierarchy {

void LeafGroups::make(LargeVector<Item> boxes, uint32_t most, Kind kind) {
    constexpr uint32_t LeavesAGroup = 8;
    constexpr size_t ItemsATask = 65536;
    const SplitTree tree = split_all(std::move(boxes), most);
    items.resize(tree.items.size());
    tasks::parallel_chunks(items.size(), ItemsATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            items[i] = tree.items[i].index();
    });
    std::vector<int32_t> todo;
    if (!tree.branches.empty())
        todo.push_back(0);
    while (!todo.empty()) {
        const int32_t b = todo.back();
        todo.pop_back();
        const SplitTree::Branch& branch = tree.branches[size_t(b)];
        if (branch.leaves > LeavesAGroup) {
            todo.push_back(branch.right), todo.push_back(branch.left);
            continue;
        }
        Group group{kind, 0};
        group.source = uint32_t(leaves.size());
        collect(tree, b, group);
        groups.push_back(group);
    }
}

void LeafGroups::collect(const SplitTree& tree, int32_t branch, Group& group) {
    const SplitTree::Branch& b = tree.branches[size_t(branch)];
    if (b.left < 0) {
        group.box[group.count++] = b.box();
        leaves.push_back({b.begin, b.end});
        return;
    }
    collect(tree, b.left, group);
    collect(tree, b.right, group);
}

} // namespace kanuka::hierarchy
