#include "render/air.h"

#include <cmath>
#include <cstring>

#include "base/sampling.h"
#include "render/wide_lights.h"
#include "sl/sl.h"

namespace kanuka::render {

namespace {

constexpr int W = 8;

// Shadow rays from points of a march.
class Packet {
  public:
    Packet(const grid::Ways& ways, int count) : m_ways(ways), m_count(count) {
        m_rays.passages = m_passages;
        m_rays.active = Int<W>::lane_index() < Int<W>(count);
    }
    void set(int k, const sl::LightRequest& q, int i, const WideLights::Sample& to, uint32_t asked) {
        const int way = i % m_ways.count;
        const Vec3f P(q.P[0][i], q.P[1][i], q.P[2][i]);
        const float distance = length(to.L);
        const Vec3f d = to.L * (1 / std::max(distance, 1e-30f));
        const float size = std::max({std::abs(P.x), std::abs(P.y), std::abs(P.z)});
        for (int c = 0; c < 3; c++)
            m_rays.o[c].v[k] = P[c], m_rays.d[c].v[k] = d[c];
        m_rays.t_min.v[k] = size * 4e-6f; // where a march ends at a surface, clear of it
        m_rays.t_max.v[k] = to.far ? 1e30f : distance * (1 - 1e-5f);
        const uint32_t seed = uint32_t(m_ways.seed[way]) ^ (asked * 0x9e3779b9u);
        m_rays.seed.v[k] = hash_bits(Int<1>(int(seed)))[0];
        m_rays.time.v[k] = m_ways.time[way];
        m_rays.level.v[k] = m_ways.level[way];
        m_rays.passes.v[k] = to.passes;
    }
    // The parts of light that get through.
    void trace(const bvh::Scene& bvh, Rgb* part) {
        const Mask<W> hidden = bvh.occluded(m_rays);
        for (int k = 0; k < m_count; k++)
            part[k] = hidden[k] ? Rgb(0) : m_passages[k].before(m_rays.t_max[k]);
    }

  private:
    const grid::Ways& m_ways;
    int m_count;
    bvh::RayPacket<W> m_rays;
    bvh::LetThrough m_passages[W];
};

// What is known of a light at points: a march asks again and again, of ways that have come to their end at
// the same point, and for each colour that may be at the far end.
struct Known {
    std::vector<float> P[3], part[3];
};

class Looking final : public shade::AirLights {
  public:
    Looking(const bvh::Scene& bvh, std::span<const scene::Light> lights, const WideLights& wide,
            const grid::Ways& ways)
        : m_bvh(bvh), m_lights(lights), m_wide(wide), m_ways(ways), m_known(lights.size()) {}

    void dim(const sl::LightRequest& q, bool far) override {
        const scene::Light& light = m_lights[size_t(q.light)];
        m_asked++;
        if (!light.shadows)
            return;
        Known& known = m_known[size_t(q.light)];
        for (int c = 0; c < 3 && known.P[c].size() < size_t(q.count); c++) {
            known.P[c].resize(size_t(q.count), NAN);
            known.part[c].resize(size_t(q.count), 1);
        }
        int queue[W], queued = 0;
        for (int i = 0; i < q.count; i++) {
            if (q.Cl[0][i] == 0 && q.Cl[1][i] == 0 && q.Cl[2][i] == 0)
                continue;
            if (is_at(known, i, q, i) || is_first(q, i) < i)
                continue;
            queue[queued++] = i;
            if (queued == W) {
                trace(q, queue, queued, far, light.passes, known);
                queued = 0;
            }
        }
        if (queued > 0)
            trace(q, queue, queued, far, light.passes, known);
        for (int i = 0; i < q.count; i++) {
            const int k = is_first(q, i);
            if (k != i)
                copy(known, k, i);
            for (int c = 0; c < 3; c++)
                q.Cl[c][i] *= is_at(known, i, q, i) ? known.part[c][size_t(i)] : 1;
        }
    }
    int wide() const override { return m_wide.count(); }
    // At each point another place of the light, spread over it along the march: Roberts' sequence, begun anew
    // on each way.
    void ask(const sl::LightRequest& q) override {
        m_asked++;
        int queue[W], queued = 0;
        WideLights::Sample samples[W];
        const auto flush = [&] {
            Packet packet(m_ways, queued);
            for (int k = 0; k < W; k++)
                packet.set(k, q, queue[std::min(k, queued - 1)], samples[std::min(k, queued - 1)], m_asked);
            Rgb part[W];
            packet.trace(m_bvh, part);
            for (int k = 0; k < queued; k++)
                for (int c = 0; c < 3; c++)
                    q.Cl[c][queue[k]] *= samples[k].shadows ? part[k][c] : 1;
            queued = 0;
        };
        for (int i = 0; i < q.count; i++) {
            const uint32_t seed = uint32_t(m_ways.seed[i % m_ways.count]) ^ uint32_t(q.light) * 0x85ebca6bu;
            const auto unit = [&](uint32_t salt, double step) {
                const double x = double(to_unit(hash_bits(Int<1>(int(seed ^ salt))))[0]) + step * m_asked;
                return std::min(float(x - std::floor(x)), 0.99999994f);
            };
            const Vec3f P(q.P[0][i], q.P[1][i], q.P[2][i]);
            const WideLights::Sample s = m_wide.sample(q.light, P, unit(0x68bc21ebu, 0.7548776662466927),
                                                       unit(0x02e5be93u, 0.5698402909980532));
            const bool lit = s.Cl.x > 0 || s.Cl.y > 0 || s.Cl.z > 0;
            for (int c = 0; c < 3; c++) {
                q.L[c][i] = lit ? s.L[c] : float(c == 2);
                q.Cl[c][i] = std::isfinite(s.Cl[c]) ? s.Cl[c] : 0;
            }
            if (!lit)
                continue;
            samples[queued] = s;
            queue[queued++] = i;
            if (queued == W)
                flush();
        }
        if (queued > 0)
            flush();
    }

  private:
    static bool is_at(const Known& known, int k, const sl::LightRequest& q, int i) {
        return known.P[0][size_t(k)] == q.P[0][i] && known.P[1][size_t(k)] == q.P[1][i] &&
               known.P[2][size_t(k)] == q.P[2][i];
    }
    static void copy(Known& known, int from, int to) {
        for (int c = 0; c < 3; c++) {
            known.P[c][size_t(to)] = known.P[c][size_t(from)];
            known.part[c][size_t(to)] = known.part[c][size_t(from)];
        }
    }
    // The same way for another colour, if it has come to the same point; else the point itself.
    int is_first(const sl::LightRequest& q, int i) const {
        const int k = i % m_ways.count;
        return q.P[0][k] == q.P[0][i] && q.P[1][k] == q.P[1][i] && q.P[2][k] == q.P[2][i] ? k : i;
    }

    void trace(const sl::LightRequest& q, const int* points, int count, bool far, int32_t passes,
               Known& known) {
        Packet packet(m_ways, count);
        for (int k = 0; k < W; k++) {
            const int i = points[std::min(k, count - 1)];
            packet.set(k, q, i, {{q.L[0][i], q.L[1][i], q.L[2][i]}, Rgb(0), far, passes}, m_asked);
        }
        Rgb part[W];
        packet.trace(m_bvh, part);
        for (int k = 0; k < count; k++)
            for (int c = 0; c < 3; c++) {
                known.P[c][size_t(points[k])] = q.P[c][points[k]];
                known.part[c][size_t(points[k])] = part[k][c];
            }
    }

    const bvh::Scene& m_bvh;
    std::span<const scene::Light> m_lights;
    const WideLights& m_wide;
    const grid::Ways& m_ways;
    std::vector<Known> m_known;
    uint32_t m_asked = 0;
};

class AirOfScene final : public grid::Air {
  public:
    AirOfScene(shade::ShadingSystem& shading, const bvh::Scene& bvh, std::vector<scene::Light> lamps,
               WideLights wide)
        : m_shading(shading), m_bvh(bvh), m_lamps(std::move(lamps)), m_wide(std::move(wide)) {}
    void look(int air, grid::Ways& ways) const override {
        Looking looking(m_bvh, m_lamps, m_wide, ways);
        m_shading.look(air, ways, looking);
    }

  private:
    shade::ShadingSystem& m_shading;
    const bvh::Scene& m_bvh;
    std::vector<scene::Light> m_lamps;
    WideLights m_wide;
};

} // namespace

std::unique_ptr<grid::Air> make_air(shade::ShadingSystem& shading, const bvh::Scene& bvh,
                                    std::vector<scene::Light> lamps, const transport::SceneView& view,
                                    const std::vector<scene::Light>& lights) {
    return std::make_unique<AirOfScene>(shading, bvh, std::move(lamps), WideLights(view, lights));
}

} // namespace kanuka::render
