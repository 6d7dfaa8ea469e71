// Parts of a picture: progressions that one host renders, others the rest (docs/sessions.md).
#pragma once

#include <algorithm>
#include <string>

namespace kanuka::render {

// Sums of floats depend on their order. So the sums of a picture are those of blocks of progressions, each
// summed from zero, which are added in order: whoever has made a block, the bits are the same.
constexpr int BlockSize = 64;

inline int block_begin(int progression) {
    return progression / BlockSize * BlockSize;
}
inline int block_end(int progression) {
    return block_begin(progression) + BlockSize;
}

// Progressions, first <= p < end.
struct Part {
    int first = 0, end = 0;
    int count() const { return end - first; }
};

// Throws Error, with the nearest part that would do, where it does not begin and end at blocks. The last part
// may end with the picture, which has `wanted` progressions.
void check_part(const Part& part, int wanted);

std::string progressions_text(int first, int end); // "progressions 64 to 127"

} // namespace kanuka::render
