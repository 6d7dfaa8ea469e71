// Is a page that comes from elsewhere what it says?
#pragma once

#include <optional>
#include <string>

#include "store/store.h"

namespace kanuka::store {

// xxh3 of a page with that header, whose own place for it counts as zero. A wrong count or key is as bad as a
// wrong position.
uint64_t checksum_of(PageHeader header, const Page& page);

// What is wrong with it; null = every offset and count lies within the page, and all is as it was written.
// For a page of another program the slot tables are read wrongly: what is kept of a program goes by the
// program's key.
const char* fault_of(const Page& page, const grid::LayeringProgram& program);
// The same without what depends on the program.
const char* fault_of(const Page& page);

} // namespace kanuka::store
