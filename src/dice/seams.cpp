#include "dice/seams.h"

#include "base/tasks.h"

namespace kanuka::dice {

constexpr size_t Grain = 1024;

static void set3(std::vector<float>& a, int stride, int i, const Vec3f& v) {
    a[i] = v.x;
    a[i + stride] = v.y;
    a[i + 2 * size_t(stride)] = v.z;
}

Seams::Seams(const Splitter& splitter, const std::vector<grid::Grid>& grids) {
    // Two passes over the boundaries: count, then place; in between, sums. The order of members follows the
    // grids'.
    const std::vector<Piece>& pieces = splitter.pieces;
    std::vector<size_t>& begin = m_begin;
    begin.assign(grids.size() + 1, 0);
    for (size_t g = 0; g < grids.size(); g++)
        begin[g + 1] = begin[g] + 2 * size_t(pieces[g].nu + pieces[g].nv);
    std::vector<BoundaryVertex>& all = m_boundary;
    all.resize(begin.back());
    tasks::parallel_chunks(grids.size(), 16, [&](size_t from, size_t to) {
        std::vector<BoundaryVertex> list;
        for (size_t g = from; g < to; g++) {
            list_boundary(splitter, pieces[g], list);
            std::copy(list.begin(), list.end(), all.begin() + begin[g]);
        }
    });
    m_first.assign(size_t(splitter.points()) + 1, 0);
    for (const BoundaryVertex& b : all)
        m_first[b.point + 1]++;
    for (size_t i = 1; i < m_first.size(); i++)
        m_first[i] += m_first[i - 1];
    m_members.resize(all.size());
    m_group.assign(all.size(), 0);
    std::vector<uint32_t> at(m_first.begin(), m_first.end() - 1);
    for (const bool moved : {false, true})
        for (size_t g = 0; g < grids.size(); g++)
            for (size_t i = begin[g]; i < begin[g + 1]; i++)
                if (all[i].moved == moved)
                    m_members[at[all[i].point]++] = {uint32_t(g), uint32_t(all[i].index), moved};
}

void Seams::join(std::vector<grid::Grid>& grids) {
    tasks::parallel_chunks(size_t(points()), Grain, [&](size_t from, size_t to) {
        std::vector<Vec3f> normals;
        for (size_t point = from; point < to; point++) {
            const uint32_t begin = m_first[point], end = m_first[point + 1];
            if (end - begin < 2)
                continue;
            const grid::Grid& owner = grids[m_members[begin].grid];
            const Vec3f p = owner.position(m_members[begin].vertex);
            normals.clear();
            std::vector<Vec3f>& heads = normals; // the first normal of every group
            for (uint32_t m = begin; m < end; m++) {
                grid::Grid& g = grids[m_members[m].grid];
                const int v = m_members[m].vertex;
                set3(g.P, g.stride, v, p);
                const Vec3f n = g.normal(v);
                size_t k = 0;
                while (k < heads.size() && k < 255 &&
                       !(dot(n, heads[k]) > SameNormal * sqrt(length_squared(n) * length_squared(heads[k]))))
                    k++;
                if (k == heads.size())
                    heads.push_back(n);
                m_group[m] = uint8_t(k);
                set3(g.N, g.stride, v, heads[k]);
            }
        }
    });
}

void Seams::weld(std::vector<grid::Grid>& grids) const {
    tasks::parallel_chunks(size_t(points()), Grain, [&](size_t from, size_t to) {
        for (size_t point = from; point < to; point++) {
            const uint32_t begin = m_first[point], end = m_first[point + 1];
            if (end - begin < 2)
                continue;
            const auto member = [&](uint32_t m) -> grid::Grid& { return grids[m_members[m].grid]; };
            // Written as first + mean difference, so that equal positions stay what they are.
            const Vec3f first = member(begin).position(m_members[begin].vertex);
            Vec3f sum(0);
            uint32_t own = begin, groups = 0;
            for (; own < end && (own == begin || !m_members[own].moved); own++)
                sum += member(own).position(m_members[own].vertex) - first;
            const Vec3f p = first + sum * (1.0f / float(own - begin));
            for (uint32_t m = begin; m < end; m++) {
                grid::Grid& g = member(m);
                set3(g.P, g.stride, m_members[m].vertex, p);
                groups = std::max<uint32_t>(groups, m_group[m] + 1u);
            }
            for (uint32_t k = 0; k < groups; k++) {
                const auto mean = [&](uint32_t to_member) {
                    Vec3f n(0);
                    for (uint32_t m = begin; m < to_member; m++)
                        if (m_group[m] == k) {
                            const Vec3f v = member(m).normal(m_members[m].vertex);
                            const float l = length(v);
                            n += l > 0 ? v * (1 / l) : v;
                        }
                    return n;
                };
                Vec3f n = mean(own);
                if (!(length_squared(n) > 0)) // only vertices that were moved here
                    n = mean(end);
                const float l = length(n);
                for (uint32_t m = begin; m < end && l > 0; m++)
                    if (m_group[m] == k)
                        set3(member(m).N, member(m).stride, m_members[m].vertex, n * (1 / l));
            }
        }
    });
}

Vec3f Seams::position(const std::vector<grid::Grid>& grids, int point, int step) const {
    const Member& m = m_members[m_first[point]];
    const grid::Grid& g = grids[m.grid];
    if (step == 0)
        return g.position(m.vertex);
    const float* p = g.later[size_t(step) - 1].P.data() + m.vertex;
    return {p[0], p[g.stride], p[2 * size_t(g.stride)]};
}

} // namespace kanuka::dice
