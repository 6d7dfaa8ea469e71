// Builds the hierarchy, level by level: the lights of a node are split into eight by the surface area and
// orientation heuristic (Conty Estevez and Kulla 2018, eq. 1), estimated in bins.
#include "transport/light_tree.h"

#include <cmath>

#include "base/tasks.h"

namespace kanuka::transport {

namespace {

constexpr int Bins = 12;

struct Range {
    int32_t first, count;
};

// What a set of lights adds up to. The cone of normals is estimated by the length of the mean normal R: a cap
// of half angle t has R = (1 + cos t) / 2. Sums of sums stay cheap; the cones that are kept are exact.
struct Extent {
    Bounds3f box;
    Vec3f axis{0, 0, 0};
    float power = 0;
    int count = 0;

    void add(const LightBound& b) {
        box.extend(b.center - Vec3f(b.radius));
        box.extend(b.center + Vec3f(b.radius));
        if (b.cos_spread > -1)
            axis += b.axis;
        power += b.power;
        count++;
    }
    void add(const Extent& o) {
        if (o.count == 0)
            return;
        box.extend(o.box);
        axis += o.axis;
        power += o.power;
        count += o.count;
    }
    // Power times the solid angle that light goes to times the area of the box.
    float cost() const {
        if (count == 0)
            return 0;
        const Vec3f d = box.diagonal();
        // A box without area still has a length to part it by.
        const float area = d.x * d.y + d.y * d.z + d.z * d.x + 1e-3f * dot(d, d);
        const float cosine = std::clamp(2 * length(axis) / float(count) - 1, -1.0f, 1.0f);
        const float theta = std::acos(cosine), sine = std::sqrt(std::max(1 - cosine * cosine, 0.0f));
        const float all = std::min(theta + 0.5f * Pi, Pi);
        // Conty Estevez and Kulla 2018, section 4.1: M_Omega, for theta_e = 90 degrees.
        const float omega =
            2 * Pi * (1 - cosine) +
            0.5f * Pi * (2 * all * sine - std::cos(theta - 2 * all) - 2 * theta * sine + cosine);
        return power * omega * area;
    }
};

class Builder {
  public:
    explicit Builder(std::span<const LightBound> bounds) : m_bounds(bounds) {
        m_tree.place.assign(bounds.size(), -1);
        for (size_t i = 0; i < bounds.size(); i++)
            if (bounds[i].power > 0 && std::isfinite(bounds[i].power) && std::isfinite(bounds[i].radius) &&
                std::isfinite(dot(bounds[i].center, Vec3f(1.0f))))
                m_order.push_back(int32_t(i));
    }

    LightTree run() {
        m_tree.round = true;
        for (int32_t leaf : m_order) {
            m_tree.round &= m_bounds[size_t(leaf)].cos_spread <= -1;
            m_tree.linked |= m_bounds[size_t(leaf)].sets != -1;
        }
        std::vector<Range> level;
        if (!m_order.empty())
            level.push_back({0, int32_t(m_order.size())});
        m_tree.nodes.resize(level.size());
        m_tree.parent.assign(level.size(), -1);
        int32_t first = 0;
        while (!level.empty()) {
            std::vector<std::vector<Range>> parts(level.size());
            tasks::parallel_for(level.size(),
                                [&](size_t i) { parts[i] = fill(level[i], first + int32_t(i)); });
            std::vector<Range> next;
            const int32_t below = first + int32_t(level.size());
            for (size_t i = 0; i < level.size(); i++)
                for (size_t k = 0; k < parts[i].size(); k++) {
                    const int32_t node = first + int32_t(i);
                    if (parts[i][k].count == 1)
                        continue;
                    m_tree.nodes[size_t(node)].child[k] = below + int32_t(next.size());
                    m_tree.parent.push_back(8 * node + int32_t(k));
                    next.push_back(parts[i][k]);
                }
            m_tree.nodes.resize(m_tree.nodes.size() + next.size());
            first = below;
            level = std::move(next);
        }
        return std::move(m_tree);
    }

  private:
    const LightBound& bound(int32_t at) const { return m_bounds[size_t(m_order[size_t(at)])]; }

    // Splits a range into at most eight, and writes their bounds.
    std::vector<Range> fill(Range all, int32_t index) {
        LightNode node{};
        std::vector<Range> parts;
        if (all.count <= 8) {
            for (int32_t i = 0; i < all.count; i++)
                parts.push_back({all.first + i, 1});
        } else {
            parts.push_back(all);
            std::vector<float> costs{extent(all).cost()};
            while (parts.size() < 8) {
                size_t worst = parts.size();
                for (size_t i = 0; i < parts.size(); i++) // eight fit a node: parting them would fill it less
                    if (parts[i].count > 8 && (worst == parts.size() || costs[i] > costs[worst]))
                        worst = i;
                if (worst == parts.size())
                    break;
                const int32_t left = split(parts[worst]);
                const Range second{parts[worst].first + left, parts[worst].count - left};
                parts[worst].count = left;
                parts.insert(parts.begin() + ptrdiff_t(worst) + 1, second);
                costs[worst] = extent(parts[worst]).cost();
                costs.insert(costs.begin() + ptrdiff_t(worst) + 1, extent(second).cost());
            }
        }
        for (size_t k = 0; k < parts.size(); k++) {
            write(node, k, merged(parts[k]));
            if (parts[k].count == 1) {
                const int32_t leaf = m_order[size_t(parts[k].first)];
                node.child[k] = ~leaf;
                m_tree.place[size_t(leaf)] = 8 * index + int32_t(k);
            }
        }
        m_tree.nodes[size_t(index)] = node;
        return parts;
    }

    // Sums over chunks of fixed size, in order: the same for any thread count.
    Extent extent(Range r) const {
        constexpr int32_t Chunk = 16384;
        if (r.count <= Chunk) {
            Extent e;
            for (int32_t i = 0; i < r.count; i++)
                e.add(bound(r.first + i));
            return e;
        }
        std::vector<Extent> chunks(size_t((r.count + Chunk - 1) / Chunk));
        tasks::parallel_for(chunks.size(), [&](size_t c) {
            const int32_t begin = int32_t(c) * Chunk;
            chunks[c] = extent({r.first + begin, std::min(Chunk, r.count - begin)});
        });
        Extent e;
        for (const Extent& c : chunks)
            e.add(c);
        return e;
    }

    // Reorders a range so that its first lights are one part; returns how many.
    int32_t split(Range r) {
        Bounds3f centers;
        for (int32_t i = 0; i < r.count; i++)
            centers.extend(bound(r.first + i).center);
        const Vec3f d = centers.diagonal();
        int axis = -1, cut = 0;
        float best = std::numeric_limits<float>::infinity();
        const float longest = std::max({d.x, d.y, d.z});
        const auto bin_of = [&](const LightBound& b, int a) {
            return std::clamp(int((b.center[a] - centers.lo[a]) / d[a] * Bins), 0, Bins - 1);
        };
        for (int a = 0; a < 3; a++) {
            if (!(d[a] > 0))
                continue;
            Extent bins[Bins], right[Bins];
            for (int32_t i = 0; i < r.count; i++)
                bins[bin_of(bound(r.first + i), a)].add(bound(r.first + i));
            for (int b = Bins - 1; b > 0; b--) {
                if (b + 1 < Bins)
                    right[b] = right[b + 1];
                right[b].add(bins[b]);
            }
            Extent left;
            for (int b = 0; b + 1 < Bins; b++) {
                left.add(bins[b]);
                if (left.count == 0 || right[b + 1].count == 0)
                    continue;
                // Thin boxes are penalised, as in the paper: K_r.
                const float cost = (left.cost() + right[b + 1].cost()) * (longest / d[a]);
                if (cost < best)
                    best = cost, axis = a, cut = b;
            }
        }
        const auto begin = m_order.begin() + r.first, end = begin + r.count;
        if (axis < 0) // all in one place
            return r.count / 2;
        const auto middle = std::stable_partition(
            begin, end, [&](int32_t leaf) { return bin_of(m_bounds[size_t(leaf)], axis) <= cut; });
        return int32_t(middle - begin);
    }

    LightBound merged(Range r) const {
        if (r.count == 1)
            return bound(r.first);
        const Extent e = extent(r);
        LightBound b;
        b.center = e.box.center();
        b.power = e.power;
        b.sets = 0;
        b.cos_reach = 1;
        const float size = length(e.axis);
        b.axis = size > 1e-6f * float(e.count) ? e.axis * (1 / size) : Vec3f(0, 0, 1);
        float spread = 0;
        for (int32_t i = 0; i < r.count; i++) {
            const LightBound& o = bound(r.first + i);
            b.radius = std::max(b.radius, length(o.center - b.center) + o.radius);
            b.cos_reach = std::min(b.cos_reach, o.cos_reach);
            b.sets |= o.sets;
            const float theta = std::acos(std::clamp(dot(b.axis, o.axis), -1.0f, 1.0f)) +
                                std::acos(std::clamp(o.cos_spread, -1.0f, 1.0f));
            spread = std::max(spread, theta);
        }
        b.radius = std::min(b.radius * (1 + 1e-5f), 0.5f * length(e.box.diagonal()) * (1 + 1e-5f));
        b.cos_spread = spread >= Pi ? -1.0f : std::cos(spread);
        return b;
    }

    static void write(LightNode& n, size_t k, const LightBound& b) {
        n.x[k] = b.center.x, n.y[k] = b.center.y, n.z[k] = b.center.z;
        n.radius[k] = b.radius;
        n.axis_x[k] = b.axis.x, n.axis_y[k] = b.axis.y, n.axis_z[k] = b.axis.z;
        n.cos_spread[k] = b.cos_spread, n.cos_reach[k] = b.cos_reach;
        n.power[k] = b.power;
        n.sets[k] = b.sets;
    }

    std::span<const LightBound> m_bounds;
    std::vector<int32_t> m_order;
    LightTree m_tree;
};

} // namespace

LightTree build_light_tree(std::span<const LightBound> bounds) {
    return Builder(bounds).run();
}

} // namespace kanuka::transport
