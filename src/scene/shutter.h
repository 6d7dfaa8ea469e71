// How a shutter opens and closes: RenderMan's "shutteropening", and how times are drawn from it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace kanuka::scene {

// What light the open shutter lets through at a time from 0 (begins to open) to 1 (closed), 0 to 1. `opening`
// is empty (fully open all the time); {a, b}: open from a on, closing from b on, linearly; or {a, b, x1, y1,
// x2, y2, x3, y3, x4, y4}: it opens along the cubic Bezier curve (0, 0), (x1, y1), (x2, y2), (a, 1) and
// closes along (b, 1), (x3, y3), (x4, y4), (1, 0).
float shutter_openness(std::span<const float> opening, float time);

// What is wrong with it, with what would do; nothing = usable.
std::optional<std::string> fault_of_opening(std::span<const float> opening);

// Quantiles of time, in proportion to openness: entry k of Segments + 1 is the time before which k / Segments
// of the light has come; linear in between. Empty for a shutter that is open all the time.
inline constexpr int ShutterSegments = 256;
std::vector<float> shutter_quantiles(std::span<const float> opening);

} // namespace kanuka::scene
