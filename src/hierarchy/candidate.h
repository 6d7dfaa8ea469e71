// What a ray may hit, as whoever asks sees it.
#pragma once

#include "hierarchy/instances.h"

namespace kanuka::hierarchy {

enum class Query { Closest, Any };

// A hit that would be the closest so far.
struct Candidate {
    size_t ray;       // its number
    const Page& page; // that the hit lies in,
    const Ray& here;  // the ray as it runs there,
    const Hit& hit;
    const InstancePath& path; // and how it came there;
    float fraction;           // of the interval of time, where the page has shapes that change
};
// What a ray may hit. Whoever asks gives an object like this one: accepts() is called in no particular order;
// what it refuses is not there for the ray.
struct EverythingIsThere {
    static constexpr bool Filters = false;
    bool accepts(const Candidate&) const { return true; }
};

} // namespace kanuka::hierarchy
