// Seeded mutations of texts and bytes. The same seed gives the same text on every machine: no library's
// distributions are asked.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kanuka::fuzz {

class Random { // SplitMix64 (Steele et al. 2014)
  public:
    explicit Random(uint64_t seed) : m_state(seed * 0x9e3779b97f4a7c15ull + 0x1234567) {}
    uint64_t operator()() {
        uint64_t z = m_state += 0x9e3779b97f4a7c15ull;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return z ^ (z >> 31);
    }
    size_t below(size_t n) { return n == 0 ? 0 : size_t((*this)() % n); }
    bool one_in(size_t n) { return below(n) == 0; }

  private:
    uint64_t m_state;
};

// Bytes flipped, put in, taken away, copied about.
void mutate_bytes(std::string& bytes, Random& random, size_t most = size_t(1) << 20);

// Tokens of a text (RIB, shading language) swapped, numbers made huge, negative or not a number, arrays cut,
// requests repeated, lines of another text put in.
std::string mutate_text(std::string_view text, std::string_view other, Random& random);

} // namespace kanuka::fuzz
