// Work on a thread of its own, while the calling one keeps serving Python: it calls the progress function,
// and notices Ctrl-C.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "base/progress.h"
#include "python/messages.h"

namespace kanuka::python {

// Runs `work` on another thread while the caller polls Python. Progress is handed over, one report a phase at
// least.
class Supervisor {
  public:
    explicit Supervisor(nb::handle callback) : m_callback(callback) {}

    // `until`: when it counts as cancelled.
    using Clock = std::chrono::steady_clock;
    Progress progress(Clock::time_point until = Clock::time_point::max()) {
        Progress p;
        p.update = [this](std::string_view phase, double fraction) {
            std::lock_guard lock(m_mutex);
            if (m_reports.empty() || m_reports.back().first != phase)
                m_reports.emplace_back(phase, fraction);
            else
                m_reports.back().second = fraction;
        };
        p.cancelled = [this, until] { return m_cancelled.load() || Clock::now() >= until; };
        return p;
    }

    // Throws what `work` threw, or what the progress function did. A KeyboardInterrupt cancels; see
    // `interrupted`.
    void run(const std::function<void()>& work) {
        std::thread thread([&] {
            try {
                work();
            } catch (...) {
                m_failure = std::current_exception();
            }
            std::lock_guard lock(m_mutex);
            m_done = true;
            m_wake.notify_one();
        });
        std::exception_ptr python_failure;
        for (bool done = false; !done;) {
            {
                nb::gil_scoped_release free;
                std::unique_lock lock(m_mutex);
                done = m_wake.wait_for(lock, std::chrono::milliseconds(50), [this] { return m_done; });
            }
            try {
                serve();
            } catch (nb::python_error& error) {
                m_cancelled = true;
                if (error.matches(PyExc_KeyboardInterrupt))
                    m_interrupted = true;
                else if (!python_failure)
                    python_failure = std::current_exception();
            }
        }
        {
            nb::gil_scoped_release free;
            thread.join();
        }
        if (python_failure)
            std::rethrow_exception(python_failure);
        if (m_failure)
            std::rethrow_exception(m_failure);
    }

    bool was_cancelled() const { return m_cancelled; }
    void rethrow_interrupt() const {
        if (!m_interrupted)
            return;
        PyErr_SetNone(PyExc_KeyboardInterrupt);
        nb::raise_python_error();
    }

    // The same; then the messages are told, however it ended.
    void run(const std::function<void()>& work, const Messages& messages) {
        try {
            run(work);
        } catch (...) {
            messages.tell();
            throw;
        }
        messages.tell();
    }

  private:
    void serve() {
        if (PyErr_CheckSignals() != 0)
            nb::raise_python_error();
        std::vector<std::pair<std::string, double>> reports;
        {
            std::lock_guard lock(m_mutex);
            reports.swap(m_reports);
        }
        if (!m_callback.is_none() && !m_cancelled)
            for (const auto& [phase, fraction] : reports)
                m_callback(phase, fraction);
    }

    nb::handle m_callback;
    std::mutex m_mutex;
    std::condition_variable m_wake;
    bool m_done = false, m_interrupted = false;
    std::atomic<bool> m_cancelled{false};
    std::vector<std::pair<std::string, double>> m_reports;
    std::exception_ptr m_failure;
};

} // namespace kanuka::python
