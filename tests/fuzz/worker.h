// Runs numbered cases in a forked process, so that one which crashes, hangs or takes too much memory is
// caught and named, and the next one starts afresh.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace kanuka::fuzz {

struct Limits {
    // Of processor time, since other work on the machine is none of the case's; ten times as long by the
    // clock.
    double seconds = 30;         // a case; more is a hang
    uint64_t bytes = 4ull << 30; // resident; more is a find
    double slow_seconds = 5;     // reported, not a find by itself
    uint64_t large_bytes = 1ull << 30;
};

struct Finding {
    uint64_t seed;
    std::string what; // "signal 11", "more than 30 s", …
};

// What one case says of itself.
struct Outcome {
    std::string fault = {}; // empty = fine
    bool picture = false;   // it came to pixels, and did not end with an Error before
};
using Case = std::function<Outcome(uint64_t seed)>;

struct Totals {
    uint64_t cases = 0, pictures = 0;
    double seconds = 0; // of processor time, of workers that ended
};

// Seeds from `first` on, `count` of them. found() is called in the parent for each case that failed, slow()
// for those that took long or much; both may write the input down.
Totals run_cases(uint64_t first, uint64_t count, const Limits& limits, const Case& one,
                 const std::function<void(const Finding&)>& found,
                 const std::function<void(const Finding&)>& slow);

// Does what may start threads, which do not outlive a fork, in a process of its own.
void in_child(const std::function<void()>& work);

} // namespace kanuka::fuzz
