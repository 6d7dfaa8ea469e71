// Threads. TBB stays behind these few calls.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace kanuka::tasks {

// Runs `work` with at most `threads` threads for everything below it; 0 = all the machine has.
void with_threads(int threads, const std::function<void()>& work);
int max_threads();

// body(i) for every i in [0, count). Exceptions leave through the caller. Order of execution is free: results
// must not depend on it.
void parallel_for(size_t count, const std::function<void(size_t)>& body);
// body(begin, end) over chunks of at most `grain`; chunk bounds depend on count and grain alone, never on
// threads.
void parallel_chunks(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body);

// Runs `work`; while it waits for tasks of its own, its thread takes up no others: those could wait for what
// it holds.
void isolated(const std::function<void()>& work);

void parallel_sort(std::span<uint64_t> values);

} // namespace kanuka::tasks
