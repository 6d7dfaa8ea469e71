#include "base/paged_memory.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <linux/magic.h>
#include <malloc.h>
#include <map>
#include <mutex>
#include <set>
#include <sys/mman.h>
#include <sys/statfs.h>
#include <thread>
#include <unistd.h>

#include "base/byte_size.h"
#include "base/error.h"

namespace kanuka {

MemoryBudget memory_budget_of_environment() {
    const char* text = std::getenv("KANUKA_MEMORY");
    if (!text || !*text)
        return {};
    const std::optional<uint64_t> bytes = parse_byte_size(text);
    if (!bytes)
        throw Error(std::string("KANUKA_MEMORY is \"") + text + "\"; a size as 500M or 4G is expected",
                    ExitCode::Usage);
    return {*bytes, {}};
}

namespace paged_memory {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr size_t Chunk = size_t(1) << 20;     // is given back at once
constexpr size_t RoomStep = size_t(64) << 20; // of reserved space gets room at once
constexpr auto Interval = 2ms;                // a thread brings some 10 MB meanwhile

std::string scratch_folder(const std::string& named) {
    if (!named.empty())
        return named;
    for (const char* variable : {"KANUKA_SCRATCH", "TMPDIR"})
        if (const char* folder = std::getenv(variable); folder && *folder)
            return folder;
    return "/var/tmp";
}

int open_nameless(const std::string& folder) {
    if (const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600); file >= 0)
        return file;
    std::string path = folder + "/kanuka-scratch-XXXXXX"; // a file system that cannot do that
    const int file = mkostemp(path.data(), O_CLOEXEC);
    if (file >= 0)
        unlink(path.c_str());
    return file;
}

void check_folder(const std::string& folder) {
    const auto mend = "; name another folder by KANUKA_SCRATCH, or render without --memory";
    const int file = open_nameless(folder);
    if (file < 0)
        throw Error(Location{folder},
                    std::string("no scratch file can be made here: ") + std::strerror(errno) + mend);
    struct statfs of;
    const bool is_memory = fstatfs(file, &of) == 0 && (of.f_type == TMPFS_MAGIC || of.f_type == RAMFS_MAGIC);
    close(file);
    if (is_memory)
        throw Error(Location{folder}, std::string("files here are memory") + mend);
}

class Pager {
  public:
    static Pager& get() {
        static Pager& pager = *new Pager; // it outlives whoever releases something at exit
        return pager;
    }

    void hold(const MemoryBudget& budget) {
        const std::string folder = scratch_folder(budget.folder);
        check_folder(folder);
        const std::lock_guard lock(m_mutex);
        m_folder = folder;
        m_bounds.insert(budget.bytes);
        m_bound = *m_bounds.begin();
        m_next_look = Clock::time_point();
        if (!m_thread.joinable())
            m_thread = std::jthread([this](const std::stop_token& stop) { run(stop); });
    }
    void let_go(uint64_t bytes) {
        std::jthread ended;
        {
            const std::lock_guard lock(m_mutex);
            m_bounds.erase(m_bounds.find(bytes));
            m_bound = m_bounds.empty() ? 0 : *m_bounds.begin();
            m_next_look = Clock::time_point();
            if (m_bounds.empty())
                ended = std::move(m_thread);
        }
        if (ended.joinable())
            ended.request_stop(); // and joins, without the lock
    }

    void* map(size_t bytes, size_t room) {
        if (m_bound == 0)
            return nullptr;
        const std::lock_guard lock(m_mutex);
        Region region{.bytes = bytes, .room = 0, .file = open_nameless(m_folder)};
        if (region.file < 0 || ftruncate(region.file, off_t(bytes)) != 0) {
            refuse(room, errno);
            drop(region);
            return nullptr;
        }
        if (!add_room(region, room)) {
            refuse(room, m_counts.why);
            drop(region);
            return nullptr;
        }
        void* const p = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, region.file, 0);
        if (p == MAP_FAILED) {
            refuse(room, errno);
            drop(region);
            return nullptr;
        }
        if (region.room ==
            region.bytes) { // it is mapped, and grows no more: processes may have few open files
            close(region.file);
            region.file = -1;
        }
        m_regions.emplace(static_cast<char*>(p), region);
        m_any = true;
        return p;
    }
    bool adopt(void* p, size_t bytes) {
        if (m_bound == 0)
            return false;
        const std::lock_guard lock(m_mutex);
        m_regions.emplace(static_cast<char*>(p),
                          Region{.bytes = bytes, .room = bytes, .file = -1, .adopted = true});
        m_any = true;
        return true;
    }
    bool make_room(void* p, size_t bytes) {
        const std::lock_guard lock(m_mutex);
        Region& region = m_regions.at(static_cast<char*>(p));
        if (bytes <= region.room)
            return true;
        const size_t more = std::min(region.bytes, (bytes / RoomStep + 1) * RoomStep); // whole chunks
        if (add_room(region, more))
            return true;
        refuse(bytes - region.room, m_counts.why);
        return false;
    }
    void keep_within_bound() {
        const uint64_t bound = m_bound;
        if (bound == 0 || Clock::now() < m_next_look.load())
            return;
        // What is not paged may be more than the bound: some pages must stay all the same, to get on.
        const auto high = [&] { return std::max(bound - bound / 8, m_unpaged + bound / 4); };
        const auto low = [&] { return std::max(bound - bound / 4, m_unpaged + bound / 8); };
        if (const uint64_t now = resident(); now <= high()) {
            m_next_look = Clock::now() + time_to_bring(high() - now);
            return;
        }
        const std::lock_guard lock(m_mutex);
        if (resident() <= high()) // another thread was here
            return;
        if (Clock::now() > m_next_measure)
            m_unpaged = 0; // it may have become less
        give_back([&] { return resident() <= low(); });
        if (resident() <= low())
            return;
        malloc_trim(0); // what was freed, and the heap keeps
        m_unpaged = resident();
        m_next_measure = Clock::now() + 1s;
    }
    bool release(void* p) {
        if (!m_any)
            return false;
        const std::lock_guard lock(m_mutex);
        const auto at = m_regions.find(static_cast<char*>(p));
        if (at == m_regions.end())
            return false;
        munmap(p, at->second.bytes);
        drop(at->second);
        m_regions.erase(at);
        m_any = !m_regions.empty();
        return true;
    }
    Counts counts() {
        const std::lock_guard lock(m_mutex);
        return m_counts;
    }

  private:
    struct Region {
        size_t bytes, room; // addresses, and those of them that may be used
        int file;
        bool adopted = false; // somebody's file
    };

    // Written pages need room: a full disk would end the process at the write.
    bool add_room(Region& region, size_t room) {
        if (room <= region.room)
            return true;
        if (const int why = posix_fallocate(region.file, off_t(region.room), off_t(room - region.room))) {
            m_counts.why = why;
            return false;
        }
        m_counts.bytes += room - region.room;
        region.room = room;
        return true;
    }
    void refuse(size_t bytes, int why) {
        m_counts.refused += bytes;
        m_counts.why = why;
    }
    void drop(Region& region) {
        if (!region.adopted)
            m_counts.bytes -= region.room;
        if (region.file >= 0)
            close(region.file);
    }

    void run(const std::stop_token& stop) {
        for (std::unique_lock lock(m_wait); !stop.stop_requested();) {
            m_wake.wait_for(lock, stop, Interval, [] { return false; });
            keep_within_bound();
        }
    }

    // The least that so many bytes take to come: to ask the system costs as much as a hundred rays.
    static Clock::duration time_to_bring(uint64_t bytes) {
        // Large folios: two megabytes a fault, a quarter of a microsecond each, and several threads.
        constexpr uint64_t BytesANanosecond = 1 << 15;
        return std::min<Clock::duration>(std::chrono::nanoseconds(bytes / BytesANanosecond), 1ms);
    }
    uint64_t resident() const {
        char text[128] = {};
        if (pread(m_statm, text, sizeof text - 1, 0) <= 0)
            return 0;
        char* end = nullptr;
        std::strtoull(text, &end, 10); // addresses
        return std::strtoull(end, nullptr, 10) * uint64_t(sysconf(_SC_PAGESIZE));
    }

    // Round and round, from where the last call ended: which pages are read most, only the system knows, and
    // it keeps those in its own memory as long as there is room.
    template <class Enough>
    void give_back(const Enough& enough) {
        uint64_t all = 0;
        for (const auto& [begin, region] : m_regions)
            all += region.room;
        for (uint64_t seen = 0; seen < all && !enough();) {
            auto at = m_regions.upper_bound(m_hand);
            if (at != m_regions.begin())
                --at;
            if (m_hand < at->first || m_hand >= at->first + at->second.room) {
                at = m_hand < at->first ? at : std::next(at);
                if (at == m_regions.end())
                    at = m_regions.begin();
                m_hand = at->first;
                if (at->second.room == 0) { // reserved, and not used yet
                    m_hand = at->first + at->second.bytes;
                    continue;
                }
            }
            const size_t from = size_t(m_hand - at->first), bytes = std::min(Chunk, at->second.room - from);
            if (madvise(m_hand, bytes, MADV_DONTNEED) == 0) // of a file that is shared: nothing is lost
                m_counts.given_back += bytes;
            m_hand += bytes;
            seen += bytes;
        }
    }

    const int m_statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    std::mutex m_mutex, m_wait;
    std::condition_variable_any m_wake;
    std::string m_folder;
    std::multiset<uint64_t> m_bounds;
    std::atomic<uint64_t> m_bound{0};
    std::atomic<bool> m_any{false};
    std::map<char*, Region> m_regions;
    char* m_hand = nullptr;             // of the clock
    std::atomic<uint64_t> m_unpaged{0}; // what was resident with all pages given back; 0 = little
    Clock::time_point m_next_measure{};
    std::atomic<Clock::time_point> m_next_look{}; // at what is resident
    Counts m_counts;
    std::jthread m_thread;
};

} // namespace

Hold::Hold(const MemoryBudget& budget) : m_bytes(budget.bytes) {
    if (m_bytes > 0)
        Pager::get().hold(budget);
}
Hold::~Hold() {
    if (m_bytes > 0)
        Pager::get().let_go(m_bytes);
}

uint64_t room(const MemoryBudget& budget) {
    struct statfs of;
    return statfs(scratch_folder(budget.folder).c_str(), &of) == 0
               ? uint64_t(of.f_bavail) * uint64_t(of.f_bsize)
               : 0;
}

void* allocate(size_t bytes) {
    return Pager::get().map(bytes, bytes);
}
void* reserve(size_t bytes) {
    return Pager::get().map(bytes, 0);
}
bool make_room(void* p, size_t bytes) {
    return Pager::get().make_room(p, bytes);
}
void keep_within_bound() {
    Pager::get().keep_within_bound();
}
bool adopt(void* p, size_t bytes) {
    return Pager::get().adopt(p, bytes);
}
bool release(void* p) {
    return Pager::get().release(p);
}
Counts counts() {
    return Pager::get().counts();
}

} // namespace paged_memory
} // namespace kanuka
