// Work that may be cancelled while tasks:: runs it.
#pragma once

#include <functional>

namespace kanuka::tasks {

// Thrown where work goes on that has been cancelled; no std::exception, so that nothing which survives those
// takes it for a fault of its own.
struct Cancelled {};
// Runs `work`, and cancels what it does in parallel soon after cancelled() says so: parallel_for leaves the
// rest out and throws Cancelled. False: it was. `cancelled` is asked on a thread of its own.
bool unless_cancelled(const std::function<bool()>& cancelled, const std::function<void()>& work);
void check_cancelled(); // throws Cancelled; for loops that run on one thread

} // namespace kanuka::tasks
