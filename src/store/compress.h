// Pages that are seldom read, in less room: words by what they differ from those before them, bytes of the
// same significance side by side, as they are alike (the "delta" and "shuffle" of HDF5 and Blosc), then zstd.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kanuka::store {

// A page takes no more than this many times its bytes in a pack: an index that claims more is damaged.
inline constexpr uint64_t MostCompressed = 256;

// Empty: they would not get smaller, or get smaller than anybody would believe.
std::vector<char> compress(std::span<const uint32_t> words);
// False: it is not made of so many words.
bool decompress(std::span<const char> bytes, std::span<uint32_t> words);

} // namespace kanuka::store
