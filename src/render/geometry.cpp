#include "render/geometry.h"

#include <chrono>
#include <iterator>

#include "base/tasks.h"
#include "render/de_instance.h"
#include "render/emitters.h"
#include "render/group_views.h"
#include "render/instance_placer.h"
#include "render/instance_primvars.h"
#include "render/motion.h"
#include "render/prepare.h"
#include "render/world_askers.h"
#include "scene/counts.h"
#include "scene/digest.h"

namespace kanuka::render {

namespace {

using Clock = std::chrono::steady_clock;

// How many primitives are prepared at once: fewer where their pages take much of a budget.
class RunLength {
  public:
    explicit RunLength(uint64_t budget) : m_budget(budget), m_length(budget > 0 ? Least : Most) {}
    size_t next() {
        if (m_budget > 0 && m_bytes > m_budget / 16)
            m_length = std::max(m_length / 2, Least);
        else if (m_budget > 0 && m_bytes < m_budget / 64)
            m_length = std::min(m_length * 2, Most);
        m_bytes = 0;
        return m_length;
    }
    void note(uint64_t bytes) { m_bytes += bytes; }

  private:
    static constexpr size_t Least = 1, Most = 256;
    uint64_t m_budget, m_bytes = 0; // of the run under way
    size_t m_length;
};

class GeometryBuilder {
  public:
    GeometryBuilder(const GeometryRequest& request, Geometry& out)
        : m_request(request), m_out(&out), m_first_group(out.levels_of_scene.size()), m_preparer(request),
          m_views(request.scene, m_first_group, request.render_from_world, request.dice.camera,
                  {request.instance_levels, request.dice.shading_rate_scale}),
          m_primvars(request.scene, m_first_group, request.shading, size_t(request.instance_variants),
                     request.journal),
          m_askers(request.scene, m_first_group, request.unique_up_to),
          m_placer(request, out, {m_views, m_primvars, m_askers}, m_first_group, m_key) {}

    void run() {
        // The world comes last, whatever is added before it.
        bvh::GroupDesc world;
        const bool extends = !m_out->groups.empty();
        if (extends) {
            world = std::move(m_out->groups.back());
            m_out->groups.pop_back();
        }
        m_key(m_out->key);
        bvh::GroupDesc here;
        build(here);
        if (!extends) {
            world = std::move(here);
        } else if (!here.shapes.empty() || !here.instances.empty()) {
            m_out->transforms.push_back({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
            world.instances.push_back({int(m_out->groups.size()), m_out->transforms.back()});
            m_out->groups.push_back(std::move(here));
            m_out->instanced = true;
        }
        m_out->groups.push_back(std::move(world));
        m_out->key = m_key.digest();
        m_request.shading.report_ranges();
        if (m_request.disk) {
            m_request.stats.bytes.store_read = m_request.disk->bytes_read();
            m_request.stats.bytes.store_written = m_request.disk->bytes_written();
        }
        m_request.stats.bytes.grids = m_out->store.grid_bytes();
        m_request.stats.bytes.lobe_inputs = m_out->store.input_bytes();
    }

  private:
    static Transform around(const Vec3f& p) {
        return Transform::translate(double(p.x), double(p.y), double(p.z));
    }

    void build(bvh::GroupDesc& world) {
        const scene::Scene& scene = m_request.scene;
        size_t total = scene.primitives.size() + count_unique(scene, m_first_group);
        for (size_t g = 0; g < scene.groups.size(); g++)
            total += scene.groups[g].primitives.size() * (1 + m_views[g].coarser.size());
        m_preparer.expect(total);
        const auto start = Clock::now();
        for (size_t g = 0; g < scene.groups.size(); g++)
            add_group(g);
        m_askers.choose([&](size_t g) { return m_views[g].stands_in_many; }, m_request.journal);
        m_preparer.expect(total + m_askers.primitives());
        add_primitives(scene.primitives, scene.solids, m_request.render_from_world, nullptr, world);
        m_placer.add(scene.instances, {m_request.render_from_world}, world);
        for (const auto& in : scene.instances)
            if (m_placer.takes_apart(in))
                add_unique(in, Transform(), {}, {}, world);
        m_preparer.share_wall_time(std::chrono::duration<double>(Clock::now() - start).count());
    }

    // A group of the scene, at all its rates.
    void add_group(size_t g) {
        const scene::Group& group = m_request.scene.groups[g];
        const GroupView& view = m_views[g];
        const Transform built_from_group = around(-view.center);
        const size_t emitters = m_out->store.emitters().size();
        std::vector<uint64_t> vertices;
        std::vector<int> levels;
        for (size_t k = 0; k <= view.coarser.size(); k++) {
            GroupView here = view;
            here.variants = m_primvars.variants_of(g), here.group = g;
            if (k > 0)
                here.pixels_per_unit = view.coarser[k - 1], here.stands_in_many = false;
            bvh::GroupDesc desc;
            const uint64_t before = m_request.stats.count.vertices;
            // A group that nothing shows is not diced.
            if (view.pixels_per_unit > 0 &&
                !add_primitives(group.primitives, group.solids, built_from_group, &here, desc,
                                view.coarser.empty() ? nullptr : &vertices))
                break;
            m_placer.add(group.instances, {built_from_group, int(g), here.pixels_per_unit, k > 0}, desc);
            levels.push_back(int(m_out->groups.size()));
            m_out->groups.push_back(std::move(desc));
            if (k > 0) {
                m_request.stats.count.instance_levels += 1;
                m_request.stats.count.level_vertices += m_request.stats.count.vertices - before;
            } else
                m_shines.push_back(m_out->store.emitters().size() > emitters || shines_inside(group));
            if (m_shines[g] || !gets_coarser(group, vertices))
                break;
        }
        m_out->levels_of_scene.push_back(std::move(levels));
        m_out->center_of_scene.push_back(view.center);
    }

    // Lamps are sampled one by one, whichever level of detail a path sees.
    bool shines_inside(const scene::Group& group) const {
        return std::ranges::any_of(group.instances, [&](const scene::Group::Instances& in) {
            return size_t(in.group) < m_first_group || m_shines[size_t(in.group) - m_first_group];
        });
    }
    // Faces are one cell at least. `vertices`: of each primitive, at the rate before.
    bool gets_coarser(const scene::Group& group, const std::vector<uint64_t>& vertices) const {
        const auto has_levels = [&](const scene::Group::Instances& in) {
            return m_out->levels_of_scene[size_t(in.group)].size() > 1;
        };
        uint64_t sum = 0, fewest = 0;
        for (size_t i = 0; i < vertices.size(); i++) {
            const uint64_t faces = scene::primvar_counts(group.primitives[i].geometry, 0).uniform;
            sum += vertices[i], fewest += std::min(vertices[i], faces);
        }
        return sum > 0 ? sum >= 4 * fewest : std::ranges::any_of(group.instances, has_levels);
    }
    static bool are_coarser(const std::vector<Prepared>& run, const std::vector<uint64_t>& finer) {
        uint64_t sum = 0, before = 0;
        for (size_t i = 0; i < run.size(); i++)
            sum += vertices_of(run[i]), before += finer[i];
        return 2 * sum <= before;
    }
    static uint64_t bytes_of(const Prepared& p) { return p.page.words.size() * sizeof(uint32_t); }
    static uint64_t vertices_of(const Prepared& p) { return p.empty ? 0 : p.page.header().vertices; }

    // `vertices`: of each primitive; those of the rate before, if there was one. False: this one would have
    // half as many and more, and nothing was added.
    bool add_primitives(const std::vector<scene::Primitive>& primitives,
                        const std::vector<scene::Solid>& solids, const Transform& render_from_group,
                        const GroupView* instanced, bvh::GroupDesc& desc,
                        std::vector<uint64_t>* vertices = nullptr) {
        const bool again = vertices && !vertices->empty(); // coarser
        if (vertices)
            vertices->resize(primitives.size());
        // Runs of primitives are prepared in parallel and made resident in order: the same store for any
        // thread count, and never more than a run's pages twice in memory.
        RunLength run(m_request.memory_budget);
        desc.solids = solid_nodes(solids);
        m_key(uint64_t(primitives.size()));
        for (const bvh::SolidNode& node : desc.solids)
            m_key(node.kind, node.parent);
        Shapes shapes{desc, int(m_out->store.shapes().size())};
        for (size_t begin = 0, end; begin < primitives.size() && !m_request.progress.cancelled();
             begin = end) {
            end = std::min(primitives.size(), begin + run.next());
            m_preparer.begin_run(m_out->store.grid_bytes() + m_out->store.input_bytes());
            std::vector<Prepared> prepared(end - begin);
            tasks::parallel_for(end - begin, [&](size_t i) {
                const int bounded = solid_of(primitives[begin + i], desc.solids);
                m_preparer.prepare(primitives[begin + i], render_from_group, instanced,
                                   bvh::subtracted(desc.solids, bounded), prepared[i]);
            });
            m_request.stats.count.primitives += prepared.size();
            if (again && begin == 0 && !are_coarser(prepared, *vertices)) {
                std::ranges::for_each(prepared, [&](Prepared& p) { keep(p); });
                return false;
            }
            for (size_t i = 0; i < prepared.size(); i++) {
                run.note(bytes_of(prepared[i]));
                if (vertices)
                    (*vertices)[begin + i] = vertices_of(prepared[i]);
                const bool is_declared = primitives[begin + i].node != scene::NodeId::None && !again;
                if (m_request.made_again && is_declared && prepared[i].material) // not cancelled
                    m_request.made_again->note(primitives[begin + i], std::move(prepared[i].inputs),
                                               prepared[i].reasons);
                if (instanced && !again)
                    m_askers.note(instanced->group, primitives[begin + i].where, prepared[i].asks_world,
                                  vertices_of(prepared[i]), bytes_of(prepared[i]));
                keep(prepared[i]);
                if (!prepared[i].empty)
                    place(primitives[begin + i], prepared[i], shapes);
                prepared[i] = {};
            }
        }
        close_run(shapes);
        return true;
    }

    // In order: which pages find room, and packs, are the same for any thread count.
    void keep(Prepared& p) {
        if (!p.made || m_request.progress.cancelled())
            return;
        if (m_request.disk && !p.is_stored)
            m_request.disk->write(m_preparer.entry_of(p), {p.made->made, &p.made->made->page});
        m_request.pages->keep(p.content, std::move(*p.made));
    }

    // Of a group, as they become resident: those since the last run was closed bound one solid, or none.
    struct Shapes {
        bvh::GroupDesc& desc;
        int first;
        int solid = -1;
    };
    void close_run(Shapes& shapes) {
        const int next = int(m_out->store.shapes().size());
        if (next > shapes.first)
            shapes.desc.shapes.push_back({shapes.first, next - shapes.first, shapes.solid});
        shapes.first = next;
    }

    void place(const scene::Primitive& primitive, Prepared& p, Shapes& shapes) {
        const auto& program = p.material->program();
        const int bounded = solid_of(primitive, shapes.desc.solids);
        const bool shines = p.page.header().emitters > 0;
        const bool lights =
            shines && (!m_request.classic || (primitive.attributes && primitive.attributes->area_light));
        if (shines && !lights)
            ask_no_emitters(p.page);
        store::Links links = links_of(primitive, program, bounded, shines, lights);
        if (lights && links.fades()) {
            // Light sampling knows no transitions: what shines switches in the middle.
            if (links.level_from > 0.5f || links.level_to <= 0.5f)
                return;
            links.level_from = 0, links.level_to = 1;
        }
        if (m_request.pages && primitive.motion)
            m_key(primitive.motion->places);
        if (m_request.pages)
            m_key(p.key, p.offset, primitive.id, program.key(), bounded, lights, links.lit_sets,
                  links.shone_sets, links.lets_through, links.seen, links.level_from, links.level_to,
                  links.area_light);
        if (!p.path.empty() || bounded != shapes.solid)
            close_run(shapes);
        shapes.solid = bounded;
        m_out->store.add_page(p.page, program, interior_of(program, p.inside), links, primitive.id);
        m_out->moving |= p.changes || !p.path.empty();
        if (!p.path.empty())
            add_moving(std::move(p.path), shapes);
        const store::PageHeader& h = p.page.header();
        m_request.stats.count.grids += h.shapes;
        m_request.stats.count.vertices += h.vertices;
        m_request.stats.count.micropolygons += h.micropolygons;
        m_request.stats.count.traced_polygons += h.traced_polygons;
    }

    store::Links links_of(const scene::Primitive& primitive, const grid::LayeringProgram& program,
                          int bounded, bool shines, bool lights) {
        store::Links links = m_request.linking.of(m_de_instancer.declared(primitive.attributes.get()));
        if (bounded >= 0 || program.interior || turns_to_viewer(primitive))
            links.seen &= ~store::Links::OneSided;
        if (shines && !lights)
            links.seen |= store::Links::Backdrop;
        return links;
    }

    // What moves as a whole is a group of its own: the shapes since the last run was closed.
    void add_moving(std::vector<MotionPath> path, Shapes& shapes) {
        const int next = int(m_out->store.shapes().size());
        bvh::GroupDesc moving;
        moving.shapes.push_back({shapes.first, next - shapes.first, shapes.solid});
        shapes.first = next;
        m_out->paths.push_back(std::move(path));
        shapes.desc.instances.push_back({int(m_out->groups.size()),
                                         {},
                                         m_out->paths.back(),
                                         bvh::GroupDesc::Unnumbered,
                                         shapes.solid >= 0});
        m_out->groups.push_back(std::move(moving));
        m_out->instanced = true;
    }

    static std::vector<bvh::SolidNode> solid_nodes(const std::vector<scene::Solid>& solids) {
        using Kind = bvh::SolidNode::Kind;
        std::vector<bvh::SolidNode> nodes;
        for (const scene::Solid& s : solids)
            nodes.push_back({s.kind == scene::Solid::Kind::Union          ? Kind::Union
                             : s.kind == scene::Solid::Kind::Intersection ? Kind::Intersection
                             : s.kind == scene::Solid::Kind::Difference   ? Kind::Difference
                                                                          : Kind::Primitive,
                             s.parent});
        return nodes;
    }
    // Ribbons and discs show their outside wherever they are seen from.
    static bool turns_to_viewer(const scene::Primitive& p) {
        return std::holds_alternative<scene::Curves>(p.geometry) ||
               std::holds_alternative<scene::Points>(p.geometry);
    }
    static int solid_of(const scene::Primitive& p, const std::vector<bvh::SolidNode>& nodes) {
        const bool known = p.solid >= 0 && size_t(p.solid) < nodes.size();
        return known && nodes[size_t(p.solid)].kind == bvh::SolidNode::Kind::Primitive ? p.solid : -1;
    }

    int interior_of(const grid::LayeringProgram& program, const Thickness& inside) {
        if (!program.interior)
            return -1;
        store::Interior interior;
        interior.ior = program.interior->ior;
        interior.priority = program.interior->priority;
        interior.phase = program.interior->phase;
        interior.phase_inputs = program.interior->phase_inputs;
        const auto amount = [&](const Rgb& per_meter, std::array<float, 4>& spectrum) {
            const float m = std::max({per_meter.x, per_meter.y, per_meter.z});
            if (!(m * inside.most > 0))
                return false;
            const auto c = color::uplift(per_meter * (0.5f / m), m_request.palette.uplift_table());
            spectrum = {c[0], c[1], c[2], 2 * m * inside.most};
            return true;
        };
        interior.absorbs = amount(program.interior->absorption, interior.absorption_spectrum);
        interior.scatters = amount(program.interior->scattering, interior.scattering_spectrum);
        interior.field = inside.field;
        return m_out->store.add_interior(interior);
    }

    // In the world, whose group's own instances are placed one by one: they lie in this place alone.
    // `around`, and `shown_around` of what stays instanced: what they differ by that say nothing themselves.
    void add_unique(const scene::Group::Instances& in, const Transform& world_from_parent,
                    const scene::Variation& around, const scene::Variation& shown_around,
                    bvh::GroupDesc& world) {
        constexpr size_t Run = 256;
        m_key(in.variation);
        const scene::Group& group = m_request.scene.groups[size_t(in.group) - m_first_group];
        std::vector<scene::Primitive> together;
        const auto add_together = [&](size_t least) {
            if (together.size() < least)
                return;
            add_primitives(together, {}, m_request.render_from_world, nullptr, world);
            together.clear();
            m_de_instancer.forget();
        };
        for (size_t i = 0; i < in.count() && !m_request.progress.cancelled(); i++) {
            const Transform place = world_from_parent * place_of(in, i);
            const bool says = !in.variation.empty();
            const scene::Variation own = says ? one_of(in.variation, i) : around;
            const scene::Variation shown = says ? one_of(m_primvars.shown(in), i) : shown_around;
            std::vector<scene::Primitive> copies = m_de_instancer.copies(group, place, own);
            if (!group.solids.empty() || !own.tint.empty() || !own.roughness.empty())
                add_apart(copies, group.solids, own, world);
            else
                std::ranges::move(copies, std::back_inserter(together));
            add_together(Run);
            for (const scene::Group::Instances& inner : group.instances)
                if (m_placer.takes_apart(inner))
                    add_unique(inner, place, own, shown, world);
                else
                    m_placer.add({placed(inner, m_request.render_from_world * place,
                                         inner.variation.empty() ? shown : m_primvars.shown(inner))},
                                 {}, world);
        }
        add_together(1);
        m_request.stats.count.instances += in.count();
    }

    // A group of their own, which stands in the world as it is.
    void add_apart(const std::vector<scene::Primitive>& copies, const std::vector<scene::Solid>& solids,
                   const scene::Variation& own, bvh::GroupDesc& world) {
        if (copies.empty())
            return;
        bvh::GroupDesc desc;
        add_primitives(copies, solids, m_request.render_from_world, nullptr, desc);
        m_out->transforms.push_back({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
        world.instances.push_back({.group = int(m_out->groups.size()),
                                   .places = m_out->transforms.back(),
                                   .variations = m_placer.rows_of(own, 1)});
        m_out->groups.push_back(std::move(desc));
        m_out->instanced = true;
    }

    const GeometryRequest& m_request;
    Geometry* m_out;
    size_t m_first_group; // of the scene's: those before it are built
    Preparer m_preparer;
    Digester m_key;
    const GroupViews m_views;
    const InstancePrimvars m_primvars;
    WorldAskers m_askers;
    InstancePlacer m_placer;
    DeInstancer m_de_instancer;
    std::vector<bool> m_shines; // of the scene's groups, with all in them
};

} // namespace

std::unique_ptr<Geometry> build_geometry(const GeometryRequest& request) {
    auto geometry = std::make_unique<Geometry>(request.store_window);
    GeometryBuilder(request, *geometry).run();
    return geometry;
}

void extend_geometry(const GeometryRequest& request, Geometry& geometry) {
    GeometryBuilder(request, geometry).run();
}

} // namespace kanuka::render
