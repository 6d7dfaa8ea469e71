#include "bvh/kept_pages.h"

#include <algorithm>

#include "base/tasks.h"
#include "bvh/page_views.h"

namespace kanuka::bvh {

Digest digest_of_pages(const store::Store& store, std::span<const std::vector<int>> pages, bool exact) {
    std::vector<int> shapes;
    std::vector<uint64_t> sizes;
    for (const std::vector<int>& page : pages)
        shapes.insert(shapes.end(), page.begin(), page.end()), sizes.push_back(page.size());
    if (exact)
        sizes.push_back(~uint64_t(0));
    std::vector<Digest> each(shapes.size());
    tasks::parallel_for(shapes.size(), [&](size_t i) {
        const store::ShapeRecord& s = store.shapes()[size_t(shapes[i])];
        Digester d;
        d(s.motion_segments);
        for (int step = 0; step <= s.motion_segments; step++)
            if (is_fibre(s))
                put(d, fibre_view(store, s, step));
            else if (is_mesh(s))
                put(d, mesh_view(store, s, step));
            else
                put(d, grid_view(store, s, step));
        each[i] = d.digest();
    });
    return digest_of(each, sizes);
}

static hierarchy::ContentSize size_of(const store::Store& store, std::span<const int> shapes) {
    hierarchy::ContentSize size;
    for (const int shape : shapes) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        if (is_fibre(s))
            size.segments += uint64_t(s.mv);
        else if (is_mesh(s))
            size.triangles += mesh_view(store, s, 0).triangles();
        else if (has_few_cells(s))
            size.triangles += 2 * uint64_t(s.mu) * uint64_t(s.mv);
        else
            size.grids++;
    }
    return size;
}

void KeptPages::find(Leftovers* leftovers, store::HierarchyFiles* files, const Digest& group, size_t number,
                     const store::Store& store, std::span<const int> shapes) {
    m_files = files;
    const int segments = store.shapes()[size_t(shapes[0])].motion_segments;
    const hierarchy::ContentSize size = files ? size_of(store, shapes) : hierarchy::ContentSize();
    for (int interval = 0; interval < std::max(segments, 1); interval++) {
        m_content.push_back(digest_of(group, uint64_t(number), interval));
        m_found.emplace_back();
        if (leftovers) {
            if (auto left = leftovers->pages.extract(m_content.back())) {
                m_found.back() = Found{{std::move(left.mapped().page), left.mapped().lattices}, true};
                continue;
            }
        }
        if (!files)
            continue;
        if (auto found = files->find(m_content.back(), size))
            if (found->page.page().changes() == (segments > 0)) // else it is forged
                m_found.back() = Found{std::move(*found), false};
    }
}

const hierarchy::Lattices* KeptPages::lattices() const {
    for (const auto& found : m_found)
        if (found)
            return &found->lattices;
    return nullptr;
}

std::optional<hierarchy::PageMemory> KeptPages::take(size_t interval) {
    if (interval >= m_found.size() || !m_found[interval])
        return std::nullopt;
    return std::move(m_found[interval]->page);
}

void KeptPages::keep(size_t interval, const hierarchy::PageMemory& page,
                     const hierarchy::Lattices& lattices) {
    if (m_files)
        m_files->keep(m_content[interval], page, lattices);
}

} // namespace kanuka::bvh
