// What shaders gave that their materials cannot hold, over all grids: told once for each input of a shader.
#pragma once

#include <map>
#include <mutex>
#include <string>

#include "base/error.h"
#include "sl/sl.h"

namespace kanuka::shade {

// Thread safe.
class Ranges {
  public:
    void add(const sl::OutOfRange& what, const Location& where);
    // Those that have not been told.
    void report(Journal& journal);

  private:
    struct Entry {
        Location where; // the first one, of those of all materials
        float low = 0, high = 0, least = 0, most = 0;
        uint64_t count = 0;
        bool told = false;
    };
    std::mutex m_mutex;
    std::map<std::pair<std::string, std::string>, Entry> m_entries; // by shader and slot
};

} // namespace kanuka::shade
