#include "worker.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <new>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <time.h>
#include <unistd.h>

namespace kanuka::fuzz {
namespace {

// What worker and parent share. A failure's text is written before `failed`.
struct Board {
    std::atomic<uint64_t> next, done, pictures;
    std::atomic<double> began, worked; // by the clock, and the process's processor time then
    std::atomic<uint64_t> failed;      // cases that ended with a text: one at a time
    std::atomic<bool> read;
    uint64_t failed_seed;
    char text[4096];
};

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double own_work() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}
double work_of(pid_t process) {
    clockid_t clock;
    timespec t;
    if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &t) != 0)
        return 0;
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

double work_of_children() {
    rusage all;
    getrusage(RUSAGE_CHILDREN, &all);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
    return seconds(all.ru_utime) + seconds(all.ru_stime);
}

uint64_t resident(pid_t of) {
    char path[64];
    std::snprintf(path, sizeof path, "/proc/%d/statm", int(of));
    unsigned long long all = 0, pages = 0;
    if (std::FILE* f = std::fopen(path, "r")) {
        if (std::fscanf(f, "%llu %llu", &all, &pages) != 2)
            pages = 0;
        std::fclose(f);
    }
    return pages * uint64_t(sysconf(_SC_PAGESIZE));
}

[[noreturn]] void work(Board& board, uint64_t end, const Case& one) {
    for (uint64_t seed; (seed = board.next.load()) < end; board.next++) {
        board.worked = own_work();
        board.began = now();
        std::string text;
        try {
            const Outcome outcome = one(seed);
            text = outcome.fault;
            board.pictures += outcome.picture;
        } catch (const std::exception& e) {
            text = std::string("an exception that is no Error: ") + e.what();
        } catch (...) {
            text = "an exception of no known kind";
        }
        board.done++;
        std::fflush(stdout);
        if (text.empty())
            continue;
        std::snprintf(board.text, sizeof board.text, "%s", text.c_str());
        board.failed_seed = seed;
        board.read = false;
        board.failed++;
        while (!board.read)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    _exit(0);
}

} // namespace

Totals run_cases(uint64_t first, uint64_t count, const Limits& limits, const Case& one,
                 const std::function<void(const Finding&)>& found,
                 const std::function<void(const Finding&)>& slow) {
    const double before = work_of_children();
    void* shared = mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    Board& board = *new (shared) Board{};
    board.next = first;
    const uint64_t end = first + count;
    while (board.next < end) {
        board.began = now();
        board.worked = 0;
        uint64_t heard = board.failed, noted = UINT64_MAX;
        const pid_t child = fork();
        if (child == 0)
            work(board, end, one);
        int status = 0;
        std::string killed;
        for (bool gone = false; !gone;) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            if (board.failed != heard) {
                heard = board.failed;
                found({board.failed_seed, board.text});
                board.read = true;
            }
            gone = waitpid(child, &status, WNOHANG) == child;
            if (gone || !killed.empty())
                continue;
            const uint64_t seed = board.next, bytes = resident(child);
            const double took = work_of(child) - board.worked;
            if (took > limits.seconds || now() - board.began > 10 * limits.seconds)
                killed = "more than " + std::to_string(int(limits.seconds)) + " s";
            else if (bytes > limits.bytes)
                killed = "more than " + std::to_string(limits.bytes >> 20) + " MB";
            else if (seed != noted && seed < end &&
                     (took > limits.slow_seconds || bytes > limits.large_bytes)) {
                noted = seed;
                slow({seed, std::to_string(int(took)) + " s, " + std::to_string(bytes >> 20) + " MB"});
            }
            if (!killed.empty())
                kill(child, SIGKILL);
        }
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
            break;
        const uint64_t seed = board.next++;
        board.done++;
        found({seed, !killed.empty()       ? killed
                     : WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                           : "exit " + std::to_string(WEXITSTATUS(status))});
    }
    const Totals totals{board.done, board.pictures, work_of_children() - before};
    munmap(shared, sizeof(Board));
    return totals;
}

void in_child(const std::function<void()>& work) {
    const pid_t child = fork();
    if (child == 0) {
        work();
        _exit(0);
    }
    waitpid(child, nullptr, 0);
}

} // namespace kanuka::fuzz
