#include "base/digest.h"

#define XXH_INLINE_ALL // no library is needed where this runs
#include <cstdio>
#include <xxhash.h>

namespace kanuka {

struct Digester::State {
    XXH3_state_t* const xxh = XXH3_createState();
    State() { XXH3_128bits_reset(xxh); }
    ~State() { XXH3_freeState(xxh); }
    State(const State&) = delete;
};

Digester::Digester() : m_state(std::make_unique<State>()) {}
Digester::~Digester() = default;

void Digester::bytes(const void* data, size_t size) {
    XXH3_128bits_update(m_state->xxh, data, size);
}

Digest Digester::digest() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(m_state->xxh);
    return {hash.high64, hash.low64};
}

void put(Digester& d, std::string_view text) {
    d(uint64_t(text.size()));
    d.bytes(text.data(), text.size());
}

std::string Digest::text() const {
    char digits[33];
    std::snprintf(digits, sizeof digits, "%016llx%016llx", static_cast<unsigned long long>(high),
                  static_cast<unsigned long long>(low));
    return digits;
}

} // namespace kanuka
