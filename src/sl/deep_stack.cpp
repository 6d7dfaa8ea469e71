#include "sl/deep_stack.h"

#include <exception>
#include <pthread.h>

namespace kanuka::sl {

namespace {

// Address space, not memory: pages come as they are touched. Enough for the checker's 20 000 levels of
// expressions, under sanitizers too.
constexpr size_t StackBytes = size_t(512) << 20;
thread_local bool is_deep = false;

struct Job {
    const std::function<void()>& f;
    std::exception_ptr failure;
};

void* run(void* pointer) {
    Job& job = *static_cast<Job*>(pointer);
    is_deep = true;
    try {
        job.f();
    } catch (...) {
        job.failure = std::current_exception();
    }
    return nullptr;
}

} // namespace

void run_deep(const std::function<void()>& f) {
    if (is_deep)
        return f();
    Job job{f, nullptr};
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, StackBytes);
    pthread_t thread;
    const bool made = pthread_create(&thread, &attributes, run, &job) == 0;
    pthread_attr_destroy(&attributes);
    if (!made) // no address space to be had: the caller's stack must do
        return f();
    pthread_join(thread, nullptr);
    if (job.failure)
        std::rethrow_exception(job.failure);
}

} // namespace kanuka::sl
