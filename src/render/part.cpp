#include "render/part.h"

#include "base/error.h"

namespace kanuka::render {

std::string progressions_text(int first, int end) {
    if (end - first <= 1)
        return "progression " + std::to_string(first);
    return "progressions " + std::to_string(first) + " to " + std::to_string(end - 1);
}

void check_part(const Part& part, int wanted) {
    constexpr int Most = 1 << 30;
    if (part.first < 0 || part.end <= part.first || part.end > Most)
        throw Error("a part of a picture has progressions from 0 on, one or more; " +
                        std::to_string(part.first) + " to " + std::to_string(part.end - 1) + " are none",
                    ExitCode::Usage);
    const auto nearest = [](int p) { return block_begin(p + BlockSize / 2); };
    if (part.first % BlockSize == 0 && (part.end % BlockSize == 0 || part.end == wanted))
        return;
    const int first = nearest(part.first), end = std::max(nearest(part.end), first + BlockSize);
    throw Error(progressions_text(part.first, part.end) + " are no part: parts begin at a multiple of " +
                    std::to_string(BlockSize) + ", and end before one or with the picture, which has " +
                    std::to_string(wanted) + ". The nearest: " + std::to_string(first) + " to " +
                    std::to_string(end - 1),
                ExitCode::Usage);
}

} // namespace kanuka::render
