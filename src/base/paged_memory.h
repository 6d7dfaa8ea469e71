// A bound on the memory of this process. While one holds, what is large lies in files that have no name, and
// where more is resident than the bound says, some of it is given back to the system: it writes those pages
// to the disk as it needs room, and brings them when somebody reads them. Nobody who reads or writes notices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace kanuka {

struct MemoryBudget {
    uint64_t bytes = 0; // 0 = none
    std::string folder; // of the files; empty = KANUKA_SCRATCH, else TMPDIR, else /var/tmp
};
// What KANUKA_MEMORY says (as 4G). Throws Error where it is no size.
MemoryBudget memory_budget_of_environment();

// Thread safety: all functions may run at the same time.
namespace paged_memory {

// The bound, as long as this lives; of several the least counts. What was allocated meanwhile stays where it
// is.
class Hold {
  public:
    // Throws Error where no file can be made in the folder, or files there are memory.
    explicit Hold(const MemoryBudget& budget);
    ~Hold();
    Hold(const Hold&) = delete;

  private:
    uint64_t m_bytes;
};

// Zeros, with room on the disk for all of them. Null: no bound holds, or the disk is full.
void* allocate(size_t bytes);
// Address space; what is used of it needs room first. Null: no bound holds.
void* reserve(size_t bytes);
// Room on the disk for the first so many bytes of what was reserved. False: the disk is full.
bool make_room(void* p, size_t bytes);
// A file that is mapped to be read: while a bound holds, it too is given back, and brought again from where
// it lies. False: no bound holds. What was adopted is unmapped by release().
bool adopt(void* p, size_t bytes);
// False: it is none of these.
bool release(void* p);

// For who brings much in a short time, between two pieces of work: looks after the bound at once, which else
// a thread of its own does now and then. Costs nothing where no bound holds.
void keep_within_bound();
// Bytes that the folder has room for.
uint64_t room(const MemoryBudget& budget);

struct Counts {
    uint64_t bytes = 0;      // with room on the disk
    uint64_t given_back = 0; // over all time
    uint64_t refused = 0;    // for which no room could be had: they lie in memory that stays
    int why = 0;             // errno of the last of these
};
Counts counts();

} // namespace paged_memory
} // namespace kanuka
