#include "base/tasks.h"

#include <algorithm>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace kanuka::tasks {

void with_threads(int threads, const std::function<void()>& work) {
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    arena.execute(work);
}

int max_threads() {
    return tbb::this_task_arena::max_concurrency();
}

void parallel_for(size_t count, const std::function<void(size_t)>& body) {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count, 1),
        [&](const tbb::blocked_range<size_t>& r) {
            for (size_t i = r.begin(); i != r.end(); i++)
                body(i);
        },
        tbb::simple_partitioner());
}

void parallel_chunks(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
    const size_t chunks = (count + grain - 1) / grain;
    parallel_for(chunks, [&](size_t c) { body(c * grain, std::min(count, (c + 1) * grain)); });
}

} // namespace kanuka::tasks
