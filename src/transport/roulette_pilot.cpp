#include "transport/roulette_pilot.h"

#include <cmath>
#include <ranges>

#include "transport/kernel.h"
#include "transport/path_state.h"

namespace kanuka::transport {

namespace {

constexpr int MostAcross = 64, MostDown = 32; // places
constexpr int PixelsApart = 4;                // at least: in small pictures a pilot costs little, too
constexpr size_t PlacesOfBatch = 128;
// Of the net, far behind all that pictures have: what decides over a sample does not know it.
constexpr uint32_t FirstProgression = 1u << 31;
// After the first bounce, and after each: of small pictures a pilot says too little.
constexpr size_t FewestPaths = 512, FewestDepartures = 64;
constexpr double DarkestPart = 0.4; // of the median: what is darker may have the same error
// A path is never less likely to go on than its throughput: light that the pilot did not find may be there.
constexpr double Least = 1, Most = 1e6;

float radiance_of(const float* radiance, int path) {
    const float* r = radiance + 4 * path;
    return (r[0] + r[1]) + (r[2] + r[3]);
}

class Learner {
  public:
    Learner(std::span<const PilotBatch> batches, int samples, int across)
        : m_batches(batches), m_samples(size_t(samples)), m_across(size_t(across)) {
        for (size_t b = 0; b < batches.size(); b += m_samples)
            m_places += batches[b].paths.size();
    }
    std::optional<RouletteFactors> run() {
        smooth(means());
        if (!find_floor())
            return {};
        choose_pairs();
        for (size_t b = 0; b < m_batches.size(); b++)
            add_departures(m_batches[b], first_place(b));
        return factors();
    }

  private:
    struct Sums {
        double light = 0, throughput = 0, rays = 0; // of squares, but for the rays
        size_t count = 0;
    };

    size_t first_place(size_t batch) const {
        size_t first = 0;
        for (size_t b = 0; b + m_samples <= batch; b += m_samples)
            first += m_batches[b].paths.size();
        return first;
    }
    static double finite(float light) { return std::isfinite(light) ? std::max(double(light), 0.0) : 0.0; }
    // As bright as a sample may be that is no firefly.
    double clipped(double light, size_t place) const {
        return std::min(light, double(Firefly::Factor) * (m_light[place] + m_floor));
    }
    double weight(size_t place) const { return 1 / (m_light[place] * m_light[place] + m_floor * m_floor); }

    std::vector<double> means() const {
        std::vector<double> mean(m_places);
        for (size_t b = 0; b < m_batches.size(); b++)
            for (size_t k = 0, first = first_place(b); k < m_batches[b].paths.size(); k++)
                mean[first + k] += finite(m_batches[b].paths[k].light) / double(m_samples);
        return mean;
    }
    // Over 3 x 3 places: a path's own light must hardly say how much it counts.
    void smooth(const std::vector<double>& mean) {
        const size_t down = m_places / m_across;
        m_light.resize(m_places);
        for (size_t y = 0; y < down; y++)
            for (size_t x = 0; x < m_across; x++) {
                double sum = 0, n = 0;
                for (size_t j = y - (y > 0); j <= std::min(y + 1, down - 1); j++)
                    for (size_t i = x - (x > 0); i <= std::min(x + 1, m_across - 1); i++)
                        sum += mean[j * m_across + i], n++;
                m_light[y * m_across + x] = sum / n;
            }
    }
    bool find_floor() {
        std::vector<double> sorted = m_light;
        std::ranges::sort(sorted);
        const auto lit = std::ranges::upper_bound(sorted, 0.0);
        if (lit == sorted.end())
            return false;
        m_floor = DarkestPart * lit[(sorted.end() - lit) / 2];
        return true;
    }
    // Variance within pixels, and cost, of whole paths.
    struct Efficiency {
        double variance = 0, rays = 0;
        // Nets leave about half of what variance there is; what pairs take off, they would have left.
        bool is_improved_by(const Efficiency& e) const {
            const double left = variance / 2;
            return (left - (variance - e.variance)) * e.rays < left * rays;
        }
    };
    Efficiency whole_paths(uint32_t pairs) const {
        const RouletteFactors tried{{}, pairs};
        std::vector<double> sum(m_places), squares(m_places);
        Efficiency e;
        for (size_t b = 0; b < m_batches.size(); b++) {
            std::vector<PilotBatch::Path> paths = m_batches[b].paths;
            for (const PilotBatch::Departure& d : m_batches[b].departures)
                if (tried.pairs_sky(d.bounce)) {
                    PilotBatch::Path& path = paths[size_t(d.path)];
                    path.light += (d.other_sky - d.sky) / 2, path.rays++;
                }
            for (size_t k = 0, first = first_place(b); k < paths.size(); k++) {
                const double light = clipped(finite(paths[k].light), first + k);
                sum[first + k] += light, squares[first + k] += light * light;
                e.rays += paths[k].rays;
            }
        }
        const double n = double(m_samples);
        for (size_t p = 0; p < m_places; p++)
            e.variance += weight(p) * std::max(squares[p] - sum[p] * sum[p] / n, 0.0) / (n - 1);
        e.variance /= double(m_places);
        e.rays /= double(m_places) * n;
        return e;
    }
    // Bounces whose pairs make variance times cost less: what pairs have to do with the light of longer paths
    // is in it, which comes from where the sky is hidden.
    void choose_pairs() {
        m_efficiency = whole_paths(0);
        bool any_sky = false;
        for (const PilotBatch& b : m_batches)
            for (const PilotBatch::Departure& d : b.departures)
                any_sky |= d.other_sky > 0;
        for (int bounce = 0; any_sky && bounce < RouletteFactors::Depths; bounce++) {
            const uint32_t more = m_pairs | uint32_t(1) << bounce;
            if (const Efficiency e = whole_paths(more); m_efficiency.is_improved_by(e))
                m_efficiency = e, m_pairs = more;
        }
    }
    bool has_pairs(int bounce) const { return RouletteFactors{{}, m_pairs}.pairs_sky(bounce); }
    void add_departures(const PilotBatch& batch, size_t first) {
        // Backwards, so that what pairs change behind each departure is known. Of a pair one half is found at
        // the vertex, and the other behind it.
        std::vector<PilotBatch::Path> change(batch.paths.size());
        for (const PilotBatch::Departure& d : std::views::reverse(batch.departures)) {
            const size_t path = size_t(d.path), place = first + path;
            const PilotBatch::Path& whole = batch.paths[path];
            PilotBatch::Path& behind = change[path];
            const bool pairs = has_pairs(d.bounce);
            if (pairs)
                behind.light -= d.sky / 2;
            const double light = clipped(finite(whole.light - d.until.light + behind.light), place);
            Sums& sums = m_sums[size_t(std::min(d.bounce, RouletteFactors::Depths - 1))];
            sums.light += weight(place) * light * light;
            sums.throughput += double(d.throughput) * double(d.throughput);
            sums.rays += whole.rays - d.until.rays + behind.rays;
            sums.count++;
            if (pairs)
                behind.light += d.other_sky / 2, behind.rays++;
        }
    }
    std::optional<RouletteFactors> factors() const {
        RouletteFactors out{};
        out.sky_pairs = m_pairs;
        double factor = 0;
        for (size_t d = 0; d < m_sums.size(); d++) {
            const Sums& s = m_sums[d];
            if (s.count >= (d == 0 ? FewestPaths : FewestDepartures) && s.throughput > 0) {
                const double worth = s.light / s.throughput / std::max(s.rays / double(s.count), 1.0);
                factor = double(RouletteFactors::Margin) *
                         std::sqrt(worth / std::max(m_efficiency.variance / m_efficiency.rays, 1e-30));
            } else if (d == 0) {
                return {};
            } // else as after the bounce before
            out.at[d] = float(std::clamp(factor, Least, Most));
        }
        return out;
    }

    std::span<const PilotBatch> m_batches;
    size_t m_samples, m_across, m_places = 0;
    std::vector<double> m_light; // of the picture around each place
    double m_floor = 0;
    Efficiency m_efficiency;
    uint32_t m_pairs = 0; // RouletteFactors::sky_pairs
    std::array<Sums, RouletteFactors::Depths> m_sums;
};

} // namespace

void PilotBatch::begin() {
    paths.assign(places.size(), {});
    departures.clear();
    m_last = 0;
}

void PilotBatch::count_rays(const PathQueue& queue) {
    for (int i = 0; i < queue.count; i++)
        paths[size_t(std::bit_cast<int32_t>(queue.row[i][PathQueue::Path]))].rays++;
}

void PilotBatch::count_rays(std::span<const int32_t> paths_of_rays) {
    for (const int32_t path : paths_of_rays)
        paths[size_t(path)].rays++;
}

void PilotBatch::depart(const PathQueue& next, bool keeps_ratios, const float* radiance,
                        const float* other_sky, int bounce) {
    const size_t before = m_last = departures.size();
    for (int i = 0; i < next.count; i++) {
        const float* t = next.row[i] + PathQueue::Throughput;
        const int path = std::bit_cast<int32_t>(next.row[i][PathQueue::Path]);
        float ratios = 4;
        if (keeps_ratios)
            ratios = (next.ratio[0][i] + next.ratio[1][i]) + (next.ratio[2][i] + next.ratio[3][i]);
        const float throughput = std::max(std::max(t[0], t[1]), std::max(t[2], t[3])) * 4 / ratios;
        if (std::isfinite(throughput))
            departures.push_back({path,
                                  bounce,
                                  throughput,
                                  {radiance_of(radiance, path), paths[size_t(path)].rays},
                                  0,
                                  other_sky ? radiance_of(other_sky, path) : 0});
    }
    // Their order in the queue depends on the number of lanes, and sums on the order.
    std::sort(departures.begin() + ptrdiff_t(before), departures.end(),
              [](const Departure& a, const Departure& b) { return a.path < b.path; });
}

void PilotBatch::find_sky(const float* sky) {
    for (size_t d = m_last; d < departures.size(); d++)
        departures[d].sky = sky[departures[d].path];
}

void PilotBatch::finish(const float* radiance) {
    for (size_t p = 0; p < paths.size(); p++)
        paths[p].light = radiance_of(radiance, int(p));
}

RoulettePilot::RoulettePilot(int width, int height)
    : m_across(std::clamp(width / PixelsApart, 1, MostAcross)),
      m_down(std::clamp(height / PixelsApart, 1, MostDown)) {
    for (int y = 0; y < m_down; y++)
        for (int x = 0; x < m_across; x++)
            m_places.push_back({int((2 * x + 1) * int64_t(width) / (2 * m_across)),
                                int((2 * y + 1) * int64_t(height) / (2 * m_down))});
    for (size_t first = 0; first < m_places.size(); first += PlacesOfBatch)
        for (int sample = 0; sample < Samples; sample++)
            m_batches.emplace_back().places =
                std::span(m_places).subspan(first, std::min(PlacesOfBatch, m_places.size() - first));
}

bool RoulettePilot::is_wanted(const SettingsView& settings) {
    return settings.integrator.name == "path" && settings.integrator.values[0] != 0;
}

uint64_t RoulettePilot::trace(size_t batch, Kernel& kernel) {
    BatchCounts counts;
    for (size_t sample = 0; sample < Samples; sample++) {
        PilotBatch& b = m_batches[batch * Samples + sample];
        BatchRequest r{0, 0, int(b.places.size()), 1, FirstProgression + uint32_t(sample), nullptr, 0};
        r.pilot = &b;
        kernel.trace(r, counts);
    }
    return counts.rays;
}

std::optional<RouletteFactors> RoulettePilot::learn() const {
    return learn_roulette(m_batches, Samples, m_across);
}

std::optional<RouletteFactors> learn_roulette(std::span<const PilotBatch> batches, int samples, int across) {
    return Learner(batches, samples, across).run();
}

} // namespace kanuka::transport
