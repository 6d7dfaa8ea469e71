#include "hierarchy/level_boxes.h"

#include <algorithm>
#include <cmath>

namespace kanuka::hierarchy {

Transform transform_of(const std::array<float, 12>& rows) {
    Transform t;
    for (size_t r = 0; r < 3; r++)
        _mm256_storeu_pd(t.m[r].data(), _mm256_cvtps_pd(_mm_loadu_ps(rows.data() + 4 * r)));
    return t;
}

namespace {

// Around the eight corners. Rays are made for the page by numbers that are rounded: the box is a little
// larger.
Bounds3f box_of(const Transform& t, const Bounds3f& b) {
    Bounds3f box;
    for (size_t a = 0; a < 3; a++) {
        double middle = t.m[a][3], half = 0;
        for (int k = 0; k < 3; k++) {
            middle += t.m[a][size_t(k)] * (double(b.lo[k]) + double(b.hi[k])) / 2;
            half += std::abs(t.m[a][size_t(k)]) * (double(b.hi[k]) - double(b.lo[k])) / 2;
        }
        const double more = 0x1p-20 * (std::abs(middle) + half);
        box.lo[int(a)] = float(middle - half - more), box.hi[int(a)] = float(middle + half + more);
    }
    return box;
}

} // namespace

// Vertices are rounded in between: boxes are a little larger.
void bound(std::span<const Page> pages, std::span<Bounds3f> at) {
    std::ranges::fill(at, Bounds3f());
    for (size_t i = 0; i < pages.size(); i++) {
        const Page& page = pages[i];
        if (page.header().root == NoRef)
            continue;
        const ChangingNode& root = page.at<ChangingNode>(page.header().root);
        at[i].extend(bounds_at(root, 0)), at[i + 1].extend(bounds_at(root, 1));
    }
    const auto some = std::ranges::find_if_not(at, &Bounds3f::empty);
    for (Bounds3f& box : at) {
        if (box.empty())
            box = *some; // all of it is nowhere then: any box will do
        for (int a = 0; a < 3; a++) {
            const float more = 0x1p-20f * std::max(std::abs(box.lo[a]), std::abs(box.hi[a]));
            box.lo[a] -= more, box.hi[a] += more;
        }
    }
}

BoxOfEnds straight(std::span<const Bounds3f> at) {
    BoxOfEnds ends{at.front(), at.back()};
    const double steps = double(at.size() - 1);
    for (int a = 0; a < 3; a++) {
        double below = 0, above = 0; // how far others stand out
        for (size_t k = 1; k + 1 < at.size(); k++) {
            const double f = double(k) / steps;
            const auto between = [&](float begin, float end) {
                return double(begin) + (double(end) - double(begin)) * f;
            };
            below = std::max(below, between(ends.begin.lo[a], ends.end.lo[a]) - double(at[k].lo[a]));
            above = std::max(above, double(at[k].hi[a]) - between(ends.begin.hi[a], ends.end.hi[a]));
        }
        for (Bounds3f* end : {&ends.begin, &ends.end}) {
            if (below > 0)
                end->lo[a] = std::nextafter(float(double(end->lo[a]) - below), -INFINITY);
            if (above > 0)
                end->hi[a] = std::nextafter(float(double(end->hi[a]) + above), INFINITY);
        }
    }
    return ends;
}

double surplus(std::span<const Bounds3f> at) {
    if (at.size() <= 2)
        return 0;
    const auto area = [](const Vec3f& side) {
        return double(side.x) * double(side.y) + double(side.y) * double(side.z) +
               double(side.z) * double(side.x);
    };
    const BoxOfEnds ends = straight(at);
    double given = 0, straight = 0;
    for (size_t k = 0; k < at.size(); k++) {
        const float f = float(k) / float(at.size() - 1);
        given += area(at[k].hi - at[k].lo);
        straight += area(lerp(f, ends.begin.hi - ends.begin.lo, ends.end.hi - ends.end.lo));
    }
    return given > 0 && std::isfinite(straight) ? std::max(straight / given - 1, 0.0) : 0;
}

double Boxes::surplus() const {
    const size_t count = first.empty() ? 0 : first.size() - 1;
    if (count == 0 || are_two)
        return 0;
    std::vector<double> sums((count + PlacesATask - 1) / PlacesATask);
    tasks::parallel_chunks(count, PlacesATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            if (move(i))
                sums[begin / PlacesATask] += hierarchy::surplus(of(i));
    });
    double sum = 0;
    for (const double s : sums)
        sum += s;
    return sum / double(count);
}

Reaches::Reaches(std::span<const Page> pages, std::span<const size_t> places) : m_reach(pages.size()) {
    tasks::parallel_for(pages.size(), [&](size_t p) {
        if (places[p] >= Reach::FewestPlaces && kind_of(pages[p].header().root) == Kind::Nodes)
            m_reach[p].emplace(pages[p]);
    });
}

Bounds3f Reaches::box(uint32_t page, const Transform& t, const Bounds3f& box) const {
    const std::optional<Reach>& reach = m_reach[page];
    return reach ? reach->box(t) : box_of(t, box);
}

MotionPath::Around Reaches::around(uint32_t page) const {
    if (!m_reach[page])
        return {};
    return [&reach = *m_reach[page]](const Transform& t) { return reach.box(t); };
}

} // namespace kanuka::hierarchy
