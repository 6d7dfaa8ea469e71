// Recursive descent on a stack of its own: sources nest as deeply as their writers like, and callers' threads
// may have little room.
#pragma once

#include <functional>

namespace kanuka::sl {

// Calls f on a thread with a deep stack, and waits for it; what it throws comes out here. Within f, calls are
// plain.
void run_deep(const std::function<void()>& f);

} // namespace kanuka::sl
