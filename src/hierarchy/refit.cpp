#include "hierarchy/refit.h"

#include "hierarchy/lattice.h"

namespace kanuka::hierarchy {

double half_areas(const Node& node) {
    double step[3], sum = 0;
    for (int a = 0; a < 3; a++)
        step[a] = double_power_of_two((node.frame[a] & 255) - 127);
    for (int i = 0; i < Children::of(node.children).count; i++) {
        double side[3];
        for (int a = 0; a < 3; a++)
            side[a] = step[a] * (int(node.plane[a][1][i]) - int(node.plane[a][0][i]));
        sum += side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
    }
    return sum;
}

std::pair<double, double> refit_inner(const LevelNodes& nodes, std::span<Bounds3f> boxes) {
    double before = 0, now = 0;
    for (size_t n = nodes.size(); n-- > 0;) {
        Node& node = nodes[n];
        const Children children = Children::of(node.children);
        if (children.kind != Kind::Nodes)
            continue;
        Group group{Kind::Nodes, uint8_t(children.count)};
        const size_t first = nodes.number(children);
        for (size_t i = 0; i < group.count; i++)
            group.box[i] = boxes[first + i];
        before += half_areas(node);
        write_node(node, group, node.children);
        now += half_areas(node);
        boxes[n] = group.bounds();
    }
    Header& h = nodes.header();
    for (int a = 0; a < 3; a++)
        h.lower[a] = boxes[0].lo[a], h.upper[a] = boxes[0].hi[a];
    return {before, now};
}

} // namespace kanuka::hierarchy
