#include "base/tasks.h"

#include "base/cancel.h"
#include "base/paged_memory.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>
#include <tbb/task.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#include <thread>

namespace kanuka::tasks {

void with_threads(int threads, const std::function<void()>& work) {
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    arena.execute(work);
}

bool unless_cancelled(const std::function<bool()>& cancelled, const std::function<void()>& work) {
    tbb::task_group_context context(tbb::task_group_context::isolated);
    std::mutex mutex;
    std::condition_variable wake;
    bool done = false;
    std::thread watcher([&] {
        constexpr auto Pause = std::chrono::milliseconds(50);
        std::unique_lock lock(mutex);
        while (!wake.wait_for(lock, Pause, [&] { return done; }))
            if (cancelled()) {
                context.cancel_group_execution();
                return;
            }
    });
    std::exception_ptr failure;
    bool stopped = false;
    tbb::task_group group(context);
    group.run_and_wait([&] {
        try {
            work();
            stopped = tbb::is_current_task_group_canceling();
        } catch (const Cancelled&) {
            stopped = true;
        } catch (...) {
            failure = std::current_exception();
        }
    });
    {
        const std::lock_guard lock(mutex);
        done = true;
        wake.notify_one();
    }
    watcher.join();
    if (stopped)
        return false;
    if (failure)
        std::rethrow_exception(failure);
    return true;
}

void check_cancelled() {
    if (tbb::is_current_task_group_canceling())
        throw Cancelled();
}

int max_threads() {
    return tbb::this_task_arena::max_concurrency();
}

void parallel_for(size_t count, const std::function<void(size_t)>& body) {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count, 1),
        [&](const tbb::blocked_range<size_t>& r) {
            for (size_t i = r.begin(); i != r.end(); i++) {
                body(i);
                paged_memory::keep_within_bound();
            }
        },
        tbb::simple_partitioner());
    check_cancelled();
}

void parallel_chunks(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
    const size_t chunks = (count + grain - 1) / grain;
    parallel_for(chunks, [&](size_t c) { body(c * grain, std::min(count, (c + 1) * grain)); });
}

void isolated(const std::function<void()>& work) {
    tbb::this_task_arena::isolate(work);
}

void parallel_sort(std::span<uint64_t> values) {
    tbb::parallel_sort(values.begin(), values.end());
    check_cancelled();
}

} // namespace kanuka::tasks
