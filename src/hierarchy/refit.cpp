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

LevelNodes::LevelNodes(PageMemory& memory) : m_bytes(reinterpret_cast<uint8_t*>(memory.data())) {
    m_ends.assign(size(), 1);
    const auto are_two = [this](size_t first, int count) {
        for (int i = 0; i < count; i++)
            m_ends[first + 2 * size_t(i)] = 2, m_ends[first + 2 * size_t(i) + 1] = 0;
    };
    if (header().root == NoRef)
        return;
    if (is_of_ends(kind_of(header().root)))
        are_two(0, 1);
    for (size_t n = 0; n < size(); n++)
        if (const Children children = Children::of((*this)[n].children);
            m_ends[n] != 0 && is_of_ends(children.kind))
            are_two(number(children), children.count);
}

std::pair<double, double> rewrite(const LevelNodes& nodes, size_t n, Group& group,
                                  const BoxOfEnds (&box)[8]) {
    double before = 0, now = 0;
    for (uint32_t end = 0; end < nodes.ends(n); end++) {
        for (int i = 0; i < group.count; i++)
            group.box[i] = end == 0 ? box[i].begin : box[i].end;
        Node& node = nodes[n + end];
        before += half_areas(node);
        write_node(node, group, node.children);
        now += half_areas(node);
    }
    return {before, now};
}

std::pair<double, double> refit_inner(const LevelNodes& nodes, std::span<BoxOfEnds> boxes) {
    std::pair<double, double> areas;
    for (size_t n = nodes.size(); n-- > 0;) {
        const Children children = Children::of(nodes[n].children);
        if (nodes.ends(n) == 0 || !is_of_nodes(children.kind))
            continue;
        Group group{children.kind, uint8_t(children.count)};
        BoxOfEnds box[8];
        const size_t first = nodes.number(children), step = is_of_ends(children.kind) ? 2 : 1;
        for (size_t i = 0; i < group.count; i++) {
            box[i] = boxes[first + step * i];
            boxes[n].begin.extend(box[i].begin), boxes[n].end.extend(box[i].end);
        }
        const auto [before, now] = rewrite(nodes, n, group, box);
        areas.first += before, areas.second += now;
    }
    Header& h = nodes.header();
    const Bounds3f all = boxes[0].all();
    for (int a = 0; a < 3; a++)
        h.lower[a] = all.lo[a], h.upper[a] = all.hi[a];
    return areas;
}

} // namespace kanuka::hierarchy
