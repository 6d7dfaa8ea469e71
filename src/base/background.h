// Work that nobody waits for, such as the writing of files: a thread of its own does it, job by job, in the
// order in which they were posted.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace kanuka {

// Thread safety: all functions may run at the same time.
class Background {
  public:
    // `most_bytes`: what waiting jobs may hold together.
    explicit Background(uint64_t most_bytes) : m_most_bytes(most_bytes) {}
    ~Background(); // when all is done
    Background(const Background&) = delete;

    // A job that throws nothing and holds so many bytes until it is done. Waits for room.
    void post(uint64_t bytes, std::function<void()> job);
    // Until all that was posted is done.
    void wait();

  private:
    struct Job {
        uint64_t bytes;
        std::function<void()> run;
    };
    void run();

    const uint64_t m_most_bytes;
    std::mutex m_mutex;
    std::condition_variable m_posted, m_done;
    std::deque<Job> m_jobs; // the first is at work
    uint64_t m_bytes = 0;   // of all of them
    bool m_ends = false;
    std::thread m_thread; // none before the first job
};

} // namespace kanuka
