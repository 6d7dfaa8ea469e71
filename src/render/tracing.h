// The picture's samples: buckets of pixels, traced side by side, progression by progression.
#pragma once

#include <climits>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "render/accumulator.h"
#include "render/lighting.h"
#include "transport/kernel.h"
#include "transport/roulette_pilot.h"

namespace kanuka::render {

class Tracing {
  public:
    Tracing(Job& job, World& world, Lighting& lighting, const Window& window);

    // Until every pixel has been traced up to progression `end`. False: cancelled; what is there stays.
    bool run(int end);
    // Says once of what has been traced so far what was wrong with it.
    void report();

    Accumulator& gathered() { return m_gathered; }
    const Accumulator& gathered() const { return m_gathered; }

  private:
    // To `to`, within a block; false: it met procedurals that are not read yet, and left the bucket as it
    // was.
    bool trace(size_t bucket, int to);
    bool extend();
    // Where paths are to end: before the second progression, so that the first picture does not wait.
    void learn_roulette();
    void note_first_pixels();
    void count(const transport::BatchCounts& c);
    std::unique_ptr<transport::Kernel> take_kernel();
    void give_kernel(std::unique_ptr<transport::Kernel> kernel);

    Job& m_job;
    World& m_world;
    Lighting& m_lighting;
    Accumulator m_gathered;
    std::atomic<uint64_t> m_finished{0}, m_work{1};    // samples of buckets, for the progress
    transport::BatchCounts m_fireflies;                // those alone
    std::pair<int, int> m_first_nan{INT_MAX, INT_MAX}; // y, x
    bool m_has_learned = false;
    std::optional<transport::RouletteFactors> m_roulette;
    std::mutex m_mutex;
    std::vector<std::unique_ptr<transport::Kernel>> m_kernels;
};

} // namespace kanuka::render
