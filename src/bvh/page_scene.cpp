#include "bvh/page_scene.h"

#include <algorithm>
#include <limits>
#include <map>

#include "base/tasks.h"
#include "bvh/kept_pages.h"
#include "bvh/leftovers.h"
#include "bvh/page_views.h"

namespace kanuka::bvh {

namespace {

constexpr size_t ShapesATask = 64;
// So few may be as large as a landscape, whose 2^-17 shows where things stand on it. Their vertices keep 22
// bits, in leaves of floats.
constexpr uint64_t FewPolygons = 4096; // triangles

} // namespace

PageScene::PageScene(store::Store& store, std::span<const GroupDesc> groups, const PagesFrom& asked,
                     uint64_t most_bytes, store::HierarchyFiles* files, Leftovers* leftovers)
    : m_store(store), m_most_bytes(std::min(most_bytes, MostBytes)), m_files(files), m_leftovers(leftovers),
      m_view_of(groups.size(), {-1, -1, -1}) {
    if (groups.empty())
        return;
    const PagePlan plan(store, groups, asked);
    m_holds_solids = plan.holds_solids;
    for (size_t v = 0; v < plan.views.size(); v++)
        m_view_of[plan.views[v].group][size_t(plan.views[v].part)] = int(v);
    m_groups.resize(plan.views.size());
    for (size_t v = 0; v < plan.views.size(); v++)
        build_view(store, groups, plan, v);
    m_root = m_groups.back().root;
    m_leftovers = nullptr;
}

bool PageScene::is_of(Part part, const SolidTrees& trees, int solid) const {
    const bool bounds = !trees.empty() && trees.holds(solid);
    switch (part) {
    case Part::Plain: // without trees it bounds nothing here
        return !bounds && (m_holds_solids || trees.bounded_by(solid) < 0);
    case Part::Surfaces:
        return bounds;
    default:
        return true;
    }
}

// Of a part of the group, what lies in pages.
PageScene::Shapes PageScene::choose(const store::Store& store, const GroupDesc& desc, Part part, Group& group,
                                    const PagesFrom& least, uint64_t place_bytes) const {
    const SolidTrees trees(desc.solids);
    struct Found {
        std::vector<int> shapes;
        uint64_t count = 0;     // cells of grids, segments of fibres
        uint64_t triangles = 0; // of meshes
        bool fits = true;       // each shape by itself
    };
    std::array<Found, Sorts> found;
    for (const auto& range : desc.shapes)
        for (int s = range.first; s < range.first + range.count; s++) {
            const store::ShapeRecord& shape = store.shapes()[size_t(s)];
            if (!is_of(part, trees, range.solid))
                continue;
            Found& sort = found[size_t(sort_of(shape))];
            sort.shapes.push_back(s);
            sort.fits &= page_bytes(shape) < MostBytes;
            if (shape.motion_segments > 1) // pages have its vertices twice, but for the first and last time
                continue;
            if (is_fibre(shape))
                sort.count += uint64_t(shape.mv);
            else if (is_mesh(shape))
                sort.triangles += mesh_view(store, shape, 0).triangles();
            else if (!has_few_cells(shape))
                sort.count += uint64_t(shape.mu) * uint64_t(shape.mv);
        }
    Shapes chosen;
    bool has_surfaces = false;
    const auto choose_sort = [&](Sort sort, uint64_t most, std::vector<int>& to) {
        const Found& f = found[size_t(sort)];
        const bool is_chosen = !f.shapes.empty() && f.count >= most && f.fits;
        if (is_chosen)
            to.insert(to.end(), f.shapes.begin(), f.shapes.end());
        group.has[size_t(sort)] = is_chosen;
        return is_chosen;
    };
    const bool large_meshes = found[size_t(Sort::Surfaces)].triangles >= least.triangles;
    has_surfaces |= choose_sort(Sort::Surfaces, large_meshes ? 0 : least.cells, chosen.surfaces);
    has_surfaces |= choose_sort(Sort::ChangingSurfaces, least.changing, chosen.surfaces);
    // Places of a group that is in both are in both.
    const uint64_t pays = has_surfaces || least.segments == 0 ? 0 : place_bytes / BytesASegment;
    choose_sort(Sort::Fibres, std::max(least.segments, pays), chosen.fibres);
    choose_sort(Sort::ChangingFibres, std::max(least.changing, pays), chosen.fibres);
    return chosen;
}

void PageScene::build_view(store::Store& store, std::span<const GroupDesc> descs, const PagePlan& plan,
                           size_t v) {
    const auto [g, part] = plan.views[v];
    const GroupDesc& desc = descs[g];
    Group& group = m_groups[v];
    group.first_emitter = desc.emitters > 0 ? desc.first_emitter : -1;
    group.slots = desc.slots;
    if (part != Part::Plain) {
        group.ranges = desc.shapes;
        std::ranges::sort(group.ranges, {}, &GroupDesc::Range::first);
    }
    const PagesFrom least = part != Part::Plain ? PagesFrom(0)
                            : plan.fits(g)      ? plan.least
                                                : PagesFrom(std::numeric_limits<uint64_t>::max());
    // What bounds solids stays where it is given: surfaces that meet are to meet.
    const bool exact =
        std::ranges::any_of(desc.shapes, [](const GroupDesc::Range& range) { return range.solid >= 0; });
    if (const Shapes shapes = choose(store, desc, part, group, least, plan.bytes[g]); !shapes.empty())
        build_owns(store, v, shapes, exact || part != Part::Plain);
    place(desc, part, group, v, part == Part::Plain ? view_of(g, Part::Surfaces) : -1);
    if (part == Part::Surfaces && group.root != None)
        m_solids.emplace(group.root, SolidTrees(desc.solids));
}

// The group's own pages, and what stands in it: one page as it is, or all as a level.
void PageScene::place(const GroupDesc& desc, Part part, Group& group, size_t v, int surfaces) {
    std::vector<hierarchy::Placements> level;
    for (const Own& own : group.owns)
        level.push_back({own.page, {}, {}, {}, own.intervals});
    if (surfaces >= 0 && m_groups[size_t(surfaces)].root != None) {
        group.surfaces = surfaces;
        level.push_back({m_groups[size_t(surfaces)].root, {}, {}, {}, 0, true});
    }
    uint32_t count = uint32_t(level.size());
    for (const auto& in : desc.instances) {
        // Without solids of the group's own, what would bound some is there as it is.
        const bool is_here = part == Part::Plain ? !in.bounds_solid || (m_holds_solids && desc.solids.empty())
                             : part == Part::Surfaces ? in.bounds_solid
                                                      : true;
        const int view = view_of(size_t(in.group), in.bounds_solid ? Part::Whole : part);
        const uint32_t root = is_here && view >= 0 ? m_groups[size_t(view)].root : None;
        if (root == None || in.size() == 0)
            continue;
        level.push_back({root, in.places, in.paths, in.levels});
        const int first_slot = part == Part::Plain ? in.first_slot : GroupDesc::Unnumbered;
        group.runs.push_back({count, view, in.places, in.paths, first_slot, in.variations});
        count += uint32_t(in.size());
    }
    // In other groups, of which places may move, what changes has a level.
    const bool is_world = v + 1 == m_groups.size();
    if (group.surfaces < 0 && group.runs.empty() && group.owns.size() < 2 &&
        (group.owns.empty() || group.owns[0].intervals == 0 || is_world))
        group.root = group.owns.empty() ? None : group.owns[0].page;
    else
        group.root = m_world.add(level, m_leftovers ? m_leftovers->level_of(v, m_groups.size()) : nullptr);
}

PageScene::Lattices::Lattices(const store::Store& store, const Shapes& shapes, bool exact) {
    std::vector<hierarchy::GridView> voters; // those whose cells are a mesh, too
    std::vector<hierarchy::MeshView> polygons, cut;
    std::vector<hierarchy::FibreView> hairs;
    for (const int shape : shapes.surfaces) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        for (int step = 0; step <= s.motion_segments; step++)
            if (is_mesh(s))
                (stands_with_grids(s) ? cut : polygons).push_back(mesh_view(store, s, step));
            else
                voters.push_back(grid_view(store, s, step));
    }
    for (const int shape : shapes.fibres) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        for (int step = 0; step <= s.motion_segments; step++)
            hairs.push_back(fibre_view(store, s, step));
    }
    fibres = hierarchy::fibre_lattice_of(hairs);
    if (exact)
        return;
    if (!voters.empty())
        cut.clear(); // whole cells say more about what they need than slivers
    grids = hierarchy::votes_of({voters, cut}).lattice();
    uint64_t triangles = 0;
    for (const hierarchy::MeshView& mesh : polygons)
        triangles += mesh.triangles();
    meshes =
        triangles <= FewPolygons ? hierarchy::Lattice{} : hierarchy::votes_of({{}, polygons, true}).lattice();
}

// What is shaded and what lights are sampled on is what is hit.
void PageScene::Lattices::move(store::Store& store, int shape) const {
    const store::ShapeRecord& s = store.shapes()[size_t(shape)];
    if (is_fibre(s))
        return store.move_fibre(shape, [this](float* vertex) {
            const Vec3f p(vertex[0], vertex[1], vertex[2]);
            if (!hierarchy::is_somewhere(p))
                return;
            const Vec3f to = fibres.places.snap(p);
            std::copy_n(&to.x, 3, vertex);
            vertex[3] = fibres.radius(fibres.word(vertex[3]));
        });
    const hierarchy::Lattice& lattice = stands_with_grids(s) ? grids : meshes;
    store.move_vertices(
        shape, [&lattice](const Vec3f& p) { return hierarchy::is_somewhere(p) ? lattice.snap(p) : p; });
}

// Of shapes of the same number of intervals each: pages cut by their size.
std::vector<std::vector<int>> PageScene::cut_into_pages(const store::Store& store,
                                                        const Shapes& shapes) const {
    std::map<int, std::vector<int>> by_intervals;
    for (const std::vector<int>* list : {&shapes.surfaces, &shapes.fibres})
        for (const int shape : *list)
            by_intervals[store.shapes()[size_t(shape)].motion_segments].push_back(shape);
    std::vector<std::vector<int>> pages;
    for (const auto& [intervals, list] : by_intervals) {
        uint64_t bytes = m_most_bytes;
        for (const int shape : list) {
            bytes += page_bytes(store.shapes()[size_t(shape)]);
            if (bytes >= m_most_bytes) {
                pages.emplace_back();
                bytes = page_bytes(store.shapes()[size_t(shape)]);
            }
            pages.back().push_back(shape);
        }
    }
    return pages;
}

// One lattice for all of a kind, and as many pages as they need: what changes has its own, by the number of
// its intervals.
void PageScene::build_owns(store::Store& store, size_t v, const Shapes& shapes, bool exact) {
    const std::vector<std::vector<int>> pages = cut_into_pages(store, shapes);
    std::vector<KeptPages> kept(pages.size());
    uint64_t bytes = 0;
    for (const std::vector<int>& page : pages)
        for (const int shape : page)
            bytes += page_bytes(store.shapes()[size_t(shape)]);
    const hierarchy::Lattices* voted = nullptr; // for already
    store::HierarchyFiles* const files = m_files && m_files->is_worth_files(bytes) ? m_files : nullptr;
    if (files || m_leftovers) {
        const Digest group = digest_of_pages(store, pages, exact);
        for (size_t i = 0; i < pages.size(); i++) {
            kept[i].find(m_leftovers, files, group, i, store, pages[i]);
            if (kept[i].lattices())
                voted = kept[i].lattices();
        }
    }
    const Lattices lattices = voted ? Lattices(*voted) : Lattices(store, shapes, exact);
    tasks::parallel_chunks(shapes.surfaces.size(), ShapesATask, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++)
            lattices.move(store, shapes.surfaces[i]);
    });
    tasks::parallel_for(shapes.fibres.size(), [&](size_t i) { lattices.move(store, shapes.fibres[i]); });
    for (size_t i = 0; i < pages.size(); i++)
        build_own(store, v, pages[i], lattices, kept[i]);
}

void PageScene::Numbered::add(int shape, bool is_partly, size_t parts) {
    shapes.push_back(shape), partly.push_back(is_partly), first.push_back(count);
    count += uint32_t(parts);
}

PageScene::Own PageScene::number_shapes(const store::Store& store, std::span<const int> shapes) {
    Own own;
    for (const int shape : shapes) {
        const store::ShapeRecord& s = store.shapes()[size_t(shape)];
        // A ray may start inside of a fibre that lets it through: where segments join is inside too.
        const bool partly =
            is_partly_there(store, s) || (is_fibre(s) && !(s.flags & store::ShapeRecord::Balls) &&
                                          store.programs()[size_t(s.program)].lets_through());
        m_partly |= partly;
        if (is_fibre(s))
            own.fibres.add(shape, partly, size_t(s.mv));
        else if (is_mesh(s))
            own.meshes.add(shape, partly, mesh_view(store, s, 0).triangles());
        else if (has_few_cells(s))
            own.meshes.add(shape, partly, 2 * size_t(s.mu) * size_t(s.mv));
        else
            own.grids.shapes.push_back(shape), own.grids.partly.push_back(partly);
    }
    return own;
}

void PageScene::build_own(const store::Store& store, size_t v, std::span<const int> shapes,
                          const Lattices& lattices, KeptPages& kept) {
    Own own = number_shapes(store, shapes);
    own.intervals = uint32_t(store.shapes()[size_t(shapes[0])].motion_segments);
    CellCorners corners;
    std::vector<Memory> pages;
    for (int step = 0; step < std::max(int(own.intervals), 1); step++) {
        const Digest content = kept.content(size_t(step));
        if (std::optional<hierarchy::PageMemory> page = kept.take(size_t(step))) {
            if (kept.is_left_over(size_t(step)))
                m_kept_pages++;
            else
                m_page_bytes.stored += page->size();
            pages.push_back({std::move(*page), content, lattices});
            continue;
        }
        std::vector<hierarchy::GridView> grids;
        std::vector<hierarchy::MeshView> meshes;
        std::vector<hierarchy::FibreView> fibres;
        for (const int shape : own.grids.shapes)
            grids.push_back(grid_view(store, store.shapes()[size_t(shape)], step));
        for (const int shape : own.meshes.shapes) {
            const store::ShapeRecord& s = store.shapes()[size_t(shape)];
            meshes.push_back(is_mesh(s) ? mesh_view(store, s, step) : corners.mesh_view(store, s, step));
        }
        for (const int shape : own.fibres.shapes)
            fibres.push_back(fibre_view(store, store.shapes()[size_t(shape)], step));
        pages.push_back({hierarchy::build({grids, meshes, false, fibres}, lattices), content, lattices});
        const hierarchy::PageMemory& page = pages.back().page;
        if (page.page().header().root != hierarchy::NoRef)
            kept.keep(size_t(step), page, lattices);
        m_page_bytes.built += page.size();
    }
    const auto is_nowhere = [](const Memory& m) { return m.page.page().header().root == hierarchy::NoRef; };
    if (std::ranges::all_of(pages, is_nowhere))
        return;
    for (Memory& page : pages) {
        m_memory.push_back(std::move(page));
        const uint32_t number = m_world.add(m_memory.back().page.page());
        own.page = std::min(own.page, number);
        m_owner_of_page.resize(number + 1);
        m_owner_of_page[number] = {int(v), int(m_groups[v].owns.size())};
    }
    m_groups[v].owns.push_back(std::move(own));
}

Bounds3f PageScene::bounds() const {
    Bounds3f all;
    for (uint32_t i = 0; !empty() && i < std::max(root_intervals(), 1u); i++)
        if (const hierarchy::Page& page = m_world.page(m_root + i); page.header().root != hierarchy::NoRef)
            all.extend(page.bounds());
    return all;
}

uint64_t PageScene::bytes() const {
    uint64_t bytes = m_world.level_bytes();
    for (const Memory& m : m_memory)
        bytes += m.page.size();
    return bytes;
}

void PageScene::leave(Leftovers& to) {
    for (Memory& m : m_memory)
        if (m.content != Digest())
            to.pages.insert_or_assign(m.content, Leftovers::OfShapes{std::move(m.page), m.lattices});
    std::vector<hierarchy::Level> levels = m_world.take_levels();
    size_t next = 0;
    for (size_t v = 0; v < m_groups.size(); v++) // each has one level at most, in this order
        if (m_groups[v].root != None && m_world.nesting(m_groups[v].root) > 0)
            to.keep_level(v, m_groups.size(), std::move(levels[next++]));
    m_memory.clear();
    m_root = None;
}

} // namespace kanuka::bvh
