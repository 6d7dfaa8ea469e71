#include "base/background.h"

#include <utility>

namespace kanuka {

Background::~Background() {
    {
        const std::lock_guard lock(m_mutex);
        m_ends = true;
    }
    m_posted.notify_one();
    if (m_thread.joinable())
        m_thread.join();
}

void Background::post(uint64_t bytes, std::function<void()> job) {
    {
        std::unique_lock lock(m_mutex);
        // What is more than fits goes alone.
        m_done.wait(lock, [&] { return m_jobs.empty() || m_bytes + bytes <= m_most_bytes; });
        m_jobs.push_back({bytes, std::move(job)});
        m_bytes += bytes;
        if (!m_thread.joinable())
            m_thread = std::thread([this] { run(); });
    }
    m_posted.notify_one();
}

void Background::wait() {
    std::unique_lock lock(m_mutex);
    m_done.wait(lock, [&] { return m_jobs.empty(); });
}

void Background::run() {
    std::unique_lock lock(m_mutex);
    while (true) {
        m_posted.wait(lock, [&] { return m_ends || !m_jobs.empty(); });
        if (m_jobs.empty())
            return;
        const std::function<void()> job = std::move(m_jobs.front().run);
        lock.unlock();
        job();
        lock.lock();
        m_bytes -= m_jobs.front().bytes;
        m_jobs.pop_front();
        m_done.notify_all();
    }
}

} // namespace kanuka
