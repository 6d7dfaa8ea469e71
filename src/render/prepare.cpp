#include "render/prepare.h"

#include <chrono>
#include <cmath>

#include "base/tasks.h"
#include "grid/mesh_patches.h"
#include "grid/word_layout.h"
#include "render/budget.h"
#include "render/emitters.h"
#include "scene/bounds.h"
#include "scene/counts.h"
#include "scene/digest.h"
#include "shade/variants.h"

namespace kanuka::render {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

void turn_inside_out(grid::Grid& g) {
    const auto turn = [](std::vector<float>& normals) {
        for (float& x : normals)
            x = -x;
    };
    turn(g.N);
    turn(g.Ng);
    for (grid::Grid::Step& step : g.later)
        turn(step.N);
    g.flips = !g.flips;
}

// What is not instanced shows the first alone.
scene::Primitive of_one_variant(const scene::Primitive& primitive) {
    scene::Primitive one = shade::with_variant(primitive, 0);
    auto attributes = std::make_shared<scene::Attributes>(*primitive.attributes);
    attributes->variants = 1;
    one.attributes = std::move(attributes);
    return one;
}

// One value each, of what was shaded at one point.
void fold(std::vector<grid::SlotValues>& slots, int stride) {
    for (grid::SlotValues& slot : slots) {
        if (slot.uniform)
            continue;
        for (size_t c = 0; c * size_t(stride) < slot.data.size() && c < 3; c++)
            slot.value[int(c)] = slot.data[c * size_t(stride)];
        slot.uniform = true;
        slot.data.clear();
    }
}

// A vertex of what is made of grids: what shading gives, and what it is encoded to, grid by grid and as
// a page.
uint64_t shaded_bytes(const grid::LayeringProgram& program, size_t steps) {
    uint64_t floats = 0;
    for (const grid::Slot& slot : program.slots)
        floats += slot.uniform ? 0 : grid::components_of(slot.type);
    const uint64_t encoded = grid::WordLayout(program).words.size() + 1 + 3 * steps; // 1: the normal
    const uint64_t emitters = program.emits() ? 2 * sizeof(store::Emitter) : 0;      // two triangles a cell
    return (4 * floats + 8 * encoded) * uint64_t(program.variants) + 2 * emitters;
}

} // namespace

// Before a primitive is diced and after: a run of them may be more than there is memory.
void Preparer::refuse_more_than_fits() const {
    refuse_geometry_that_cannot_fit(m_resident + m_prepared, m_request.memory);
    refuse_geometry_that_cannot_fit(m_prepared, m_request.working_memory);
}

void Preparer::prepare(const scene::Primitive& declared, const Transform& parent_from_group,
                       const GroupView* instanced, bool inside_out, Prepared& out) {
    refuse_more_than_fits();
    try {
        make(declared, parent_from_group, instanced, inside_out, out);
        m_prepared += out.page.words.size() * sizeof(out.page.words[0]);
        refuse_more_than_fits();
    } catch (const CannotFit&) {
        throw;
    } catch (const std::exception& e) {
        out.empty = true;
        m_request.journal.error(declared.where, std::string("the primitive is left out: ") + e.what());
    }
    const std::lock_guard lock(m_progress_mutex);
    m_request.progress.update("dice", double(++m_done) / double(std::max<size_t>(m_total, 1)));
}

void Preparer::make(const scene::Primitive& declared, const Transform& parent_from_group,
                    const GroupView* instanced, bool inside_out, Prepared& out) {
    MovingPrimitive moving;
    if (declared.motion)
        moving = in_shutter(declared, m_request.shutter);
    const scene::Primitive& rest = declared.motion ? moving.rest : declared;
    const auto* volume = std::get_if<scene::Volume>(&rest.geometry);
    scene::Primitive boundary;
    if (volume)
        boundary = boundary_of(rest, *volume);
    else if (!instanced && rest.attributes && rest.attributes->variants > 1)
        boundary = of_one_variant(rest);
    const scene::Primitive& primitive = volume || boundary.attributes ? boundary : rest;
    const Transform parent_from_object = parent_from_group * primitive.world_from_object;
    const auto start = Clock::now();
    std::vector<Transform> while_moving;
    if (!moving.places.empty()) {
        out.path.emplace_back(moving.places, parent_from_group, parent_from_object.inverse());
        while_moving = views_of(out.path[0], instanced ? instanced->cameras : std::vector<Transform>());
    }
    const PageFrame frame =
        page_frame(primitive, parent_from_group, instanced, m_request.dice.camera, while_moving);
    out.material =
        m_request.shading.material(primitive, frame.page_from_object, frame.page_from_world,
                                   instanced ? instanced->variants : std::span<const scene::ValueList>());
    if (volume)
        fill(rest, *volume, parent_from_object, frame, instanced || !moving.places.empty(), boundary, out);
    const shade::Material& material = *out.material;
    dice::DiceTarget target = target_of(primitive, material, frame, instanced != nullptr, moving.later);
    // Lamps are sampled; what moves, and copies of what is instanced, are not recorded.
    if (m_request.oracle && !declared.motion && declared.node != scene::NodeId::None &&
        !material.program().emits())
        out.field = m_request.oracle->field(declared);
    target.field = out.field.get();
    if (m_request.pages)
        out.content = (out.inputs = inputs_of(declared, material, frame, target, inside_out)).content();
    if (!m_request.pages || !(take_kept(out) || take_stored(out))) {
        shade::SpacesRead read = dice_and_shade(declared, primitive, frame, target, inside_out, start, out);
        out.asks_world = asks_world(read);
        if (m_request.made_again) {
            out.reasons = m_request.made_again->reasons_for(declared, out.inputs, material, out.is_evicted);
            out.inputs.note_read(read, material);
        }
        if (m_request.pages)
            note_made(std::move(read), out);
    }
    out.changes = !moving.later.empty();
    if (out.empty)
        return;
    out.offset = frame.offset;
    store::translate(out.page, out.offset);
    const bool at_rest = !instanced && out.path.empty() && moving.later.empty();
    ask_uncut_emitters(out.page, m_request.clips, declared.solid >= 0, at_rest);
}

// Returns what shaders read of where the primitive stands.
shade::SpacesRead Preparer::dice_and_shade(const scene::Primitive& declared,
                                           const scene::Primitive& primitive, const PageFrame& frame,
                                           dice::DiceTarget target, bool inside_out, Clock::time_point start,
                                           Prepared& out) {
    const shade::Material& material = *out.material;
    uint64_t in_flight = 0;
    target.fits = [&](uint64_t bytes, uint64_t vertices) {
        in_flight = bytes + vertices * shaded_bytes(material.program(), 1 + target.later.size());
        return m_resident + m_prepared + in_flight <= m_request.memory &&
               m_prepared + in_flight <= m_request.working_memory;
    };
    shade::SpacesLog log;
    std::atomic<double> displacing{0};
    dice::Displace displace;
    if (material.displaces())
        displace = [&](grid::Grid& g) {
            const auto t = Clock::now();
            material.displace(g, &log);
            displacing += seconds_since(t);
        };
    dice::DiceOptions options = m_request.dice;
    options.camera.border = frame.border;
    if (target.instead_from.empty() && !frame.cameras.empty()) {
        options.camera.page_from_camera = frame.cameras[0];
        options.camera.also_from.assign(frame.cameras.begin() + 1, frame.cameras.end());
    }
    dice::Diced diced = dice::dice(primitive, target, options, displace, m_request.journal);
    if (diced.too_large)
        refuse_primitive_that_cannot_fit(declared.where, in_flight,
                                         m_request.memory_budget > 0 ? m_prepared.load()
                                                                     : m_resident + m_prepared,
                                         std::min(m_request.memory, m_request.working_memory));
    const double dicing = seconds_since(start);
    const auto shading_start = Clock::now();
    shade_and_encode(primitive, diced, material, inside_out, log, out);
    m_dice_time += std::max(0.0, dicing - displacing.load() / tasks::max_threads());
    m_shade_time += seconds_since(shading_start) + displacing.load() / tasks::max_threads();
    shade::SpacesRead read = material.reads_spaces();
    read.add(log.read());
    return read;
}

dice::DiceTarget Preparer::target_of(const scene::Primitive& primitive, const shade::Material& material,
                                     const PageFrame& frame, bool instanced,
                                     std::span<const scene::Primitive> later) const {
    dice::DiceTarget target;
    target.page_from_object = frame.page_from_object;
    target.later = later;
    if (frame.cameras.empty())
        target.pixels_per_unit = frame.pixels_per_unit;
    else if (instanced)
        target.instead_from = frame.cameras;
    target.shade_uniform = material.uniform() && !material.displaces();
    target.displacing = material.displaces() ? material.reads_displacing() : grid::Reads();
    target.shading = material.uniform() ? grid::Reads() : material.reads_shading();
    target.shading.frame = target.shading.frame || material.program().needs_tangent();
    target.keep_density = material.emission_varies();
    target.shines_along_normals = material.program().emits_along_normals();
    // What shines for the camera alone is not asked for light.
    target.polygons = material.program().emits() &&
                      (!m_request.classic || (primitive.attributes && primitive.attributes->area_light));
    if (target.polygons)
        target.finer = for_its_light(primitive, frame);
    return target;
}

// What is in a Volume. What is not in its place in render space (`elsewhere`: in instances, or as it moves)
// is as thick everywhere as it is on average.
void Preparer::fill(const scene::Primitive& primitive, const scene::Volume& volume,
                    const Transform& parent_from_object, const PageFrame& frame, bool elsewhere,
                    scene::Primitive& boundary, Prepared& out) {
    if (!out.material->program().interior) {
        if (primitive.attributes && primitive.attributes->surface)
            m_request.journal.report(
                Severity::Info, primitive.where,
                "the surface shader \"" + primitive.attributes->surface->name +
                    "\" says nothing of what is inside: the Volume is shown as smoke of its "
                    "Color, Opacity and density; \"cloud\" is a shader of volumes");
        boundary.attributes = as_smoke(primitive.attributes ? *primitive.attributes : scene::Attributes());
        out.material = m_request.shading.material(boundary, frame.page_from_object, frame.page_from_world);
    }
    out.inside = thickness_of(primitive, volume, parent_from_object);
    if (out.inside.bad > 0)
        m_request.journal.warning(primitive.where,
                                  std::to_string(out.inside.bad) +
                                      " densities are below zero or not finite and are taken as 0");
    if (elsewhere && out.inside.field) {
        m_request.journal.warning(primitive.where,
                                  "a Volume that moves or is instanced is as thick everywhere as it is "
                                  "on average");
        out.inside.field = nullptr;
        out.inside.most = out.inside.mean;
    }
}

namespace {

// How large a lamp with curves is, and how many cells it wants across. None: it has no curves, or is diced by
// other rules, or has as many faces, each of which is a cell at least.
struct Curved {
    float size, across;
};
std::optional<Curved> curved(const scene::Primitive& primitive) {
    if (const auto* quadric = std::get_if<scene::Quadric>(&primitive.geometry)) {
        float size = 0; // angles are arguments too, and of those that matter none is larger than lengths
        for (size_t i = 0; i + 1 < quadric->arguments.size(); i++)
            size = std::max(size, std::abs(quadric->arguments[i]));
        return Curved{size, 24};
    }
    constexpr float Across = 16; // a bulb of six faces has 1 % less area than a round one
    double faces = 0;
    if (const auto* mesh = std::get_if<scene::SubdivisionMesh>(&primitive.geometry)) {
        if (mesh->scheme != "bilinear")
            faces = double(mesh->vertices_per_face.size());
    } else if (const auto* patches = std::get_if<scene::PatchMesh>(&primitive.geometry)) {
        if (patches->cubic)
            faces = double(scene::primvar_counts(primitive.geometry, 0).uniform);
    } else if (std::holds_alternative<scene::NuPatch>(primitive.geometry)) {
        faces = double(scene::primvar_counts(primitive.geometry, 0).uniform);
    }
    const Bounds3f bounds = scene::object_bounds(primitive);
    if (!(faces > 0 && faces < double(Across * Across)) || bounds.empty())
        return std::nullopt;
    const Vec3f extent = bounds.hi - bounds.lo;
    return Curved{0.5f * max(max(extent.x, extent.y), extent.z), Across};
}

} // namespace

// A lamp of a pixel would be a polygon of few corners, inscribed in its outline: a square for a disk, which
// has 2 / pi of its light. So curved lamps have a least number of cells across, wherever they stand.
float Preparer::for_its_light(const scene::Primitive& primitive, const PageFrame& frame) const {
    constexpr float OutOfThePicture = 9; // coarser there: Density
    const std::optional<Curved> lamp = curved(primitive);
    if (!lamp)
        return 1;
    const float scale = std::cbrt(std::abs(float(frame.page_from_object.determinant3())));
    const Vec3f eye = frame.cameras.empty() ? Vec3f(0) : frame.cameras[0].point({0, 0, 0});
    const float distance = std::max(length(frame.page_from_object.point({0, 0, 0}) - eye), 1e-6f);
    const dice::DicingCamera& camera = m_request.dice.camera;
    const float rate = frame.pixels_per_unit > 0                       ? frame.pixels_per_unit
                       : camera.projection == Projection::Orthographic ? camera.finest_pixels()
                                                                       : camera.finest_pixels() / distance;
    const bool in_the_picture = frame.border == dice::DicingCamera::Border::Within && !frame.cameras.empty();
    const float pixels = 2 * lamp->size * scale * rate / (in_the_picture ? 1 : OutOfThePicture);
    return std::clamp(lamp->across / std::max(pixels, 1e-6f), 1.0f, 1e4f);
}

// A moving thing that the camera sees is seen as if the camera moved the other way. `instead_from`: as
// DiceTarget has it.
std::vector<Transform> Preparer::views_of(const MotionPath& path,
                                          const std::vector<Transform>& instead_from) const {
    constexpr size_t Times = 4;
    const dice::DicingCamera& camera = m_request.dice.camera;
    std::vector<Transform> views;
    for (size_t i = 1; i <= Times; i++)
        try {
            const Transform back = path.at(double(i) / Times).inverse();
            for (const Transform& from : instead_from)
                views.push_back(back * from);
            if (instead_from.empty())
                views.push_back(back * (camera.also_from.size() == Times ? camera.also_from[i - 1]
                                                                         : camera.page_from_camera));
        } catch (const Error&) { // flattened then
        }
    return views;
}

void Preparer::shade_and_encode(const scene::Primitive& primitive, dice::Diced& diced,
                                const shade::Material& material, bool inside_out, shade::SpacesLog& log,
                                Prepared& out) {
    const size_t count = diced.is_mesh ? 1 : diced.grids.size();
    std::vector<grid::VertexInputs> inputs(count);
    std::vector<store::ShadedGrid> shaded(count);
    const uint64_t variants = uint64_t(material.program().variants);
    // A material that nothing varies in is shaded at one point, once for all its grids.
    grid::VertexInputs once;
    if (material.uniform()) {
        grid::Grid point;
        point.allocate(0, 0);
        point.N[2 * size_t(point.stride)] = 1;
        material.shade(point, once, &log);
        fold(once.slots, once.stride);
        for (auto& slots : once.variants)
            fold(slots, once.stride);
        m_request.stats.count.shader_evaluations += variants;
    }
    const bool may_round =
        !material.displaces() && !(primitive.attributes && !primitive.attributes->shadow_terminator);
    const auto normals_of = [&](const grid::Grid& g) {
        return g.later.empty() && !may_round ? std::vector<float>() : g.N;
    };
    const bool patches = diced.is_mesh && !material.uniform();
    bool rounded_mesh = may_round;
    if (patches) {
        const std::vector<float> normals = normals_of(diced.mesh_vertices);
        shade_mesh(diced, material, inputs[0], log);
        rounded_mesh = may_round && diced.mesh_vertices.N == normals;
        grid::carry_normals(diced.mesh_vertices, normals);
    }
    tasks::parallel_for(count, [&](size_t i) {
        grid::Grid& g = diced.is_mesh ? diced.mesh_vertices : diced.grids[i]; // shading may set N: bumps
        bool smooth = rounded_mesh;
        if (!material.uniform() && !patches) {
            const std::vector<float> normals = normals_of(g);
            material.shade(g, inputs[i], &log);
            smooth = may_round && g.N == normals;
            grid::carry_normals(g, normals);
            m_request.stats.count.shader_evaluations += variants * uint64_t(g.vertices());
        }
        if (inside_out)
            turn_inside_out(g);
        shaded[i] = {&g, diced.is_mesh ? nullptr : &diced.traced[i], diced.is_mesh ? &diced.mesh : nullptr,
                     material.uniform() ? &once : &inputs[i], smooth};
    });
    if (count == 0)
        return;
    // What trim curves cut is traced as one mesh, made after shading.
    std::vector<grid::TrimmedPart> parts;
    for (size_t i = 0; i < diced.trimmed.size(); i++)
        if (!diced.trimmed[i].indices.empty()) {
            parts.push_back({shaded[i].grid, shaded[i].inputs, &diced.trimmed[i]});
            shaded[i].grid = nullptr;
        }
    grid::Grid cut;
    grid::VertexInputs cut_inputs;
    grid::TracedMesh cut_mesh;
    if (!parts.empty()) {
        grid::merge_trimmed(parts, material.program().slots, cut, cut_inputs, cut_mesh);
        std::erase_if(shaded, [](const store::ShadedGrid& s) { return s.grid == nullptr; });
        shaded.push_back({&cut, nullptr, &cut_mesh, &cut_inputs});
    }
    uint64_t bad = 0, lost = 0;
    out.page = store::encode(shaded, material.program(), bad, &m_request.palette, &lost);
    if (primitive.attributes && primitive.attributes->area_light)
        spread_flux(*primitive.attributes->area_light, out.page);
    out.empty = false;
    if (shines_without_area(out.page))
        m_request.journal.warning(primitive.where, "a light of no area sheds no light: all its facets are "
                                                   "points or lines");
    say_of_values(primitive.where, bad, lost);
}

// A mesh is shaded patch by patch: side by side, and cancelled between two of them.
void Preparer::shade_mesh(dice::Diced& diced, const shade::Material& material, grid::VertexInputs& inputs,
                          shade::SpacesLog& log) {
    grid::Grid& g = diced.mesh_vertices;
    const grid::MeshPatches patches(g, diced.mesh, diced.mesh_rest.empty() ? g.P : diced.mesh_rest,
                                    material.reads_shading().rings);
    std::vector<float> normals = g.N;
    grid::MeshInputs whole(g);
    std::mutex mutex;
    bool facets = g.facets;
    tasks::parallel_for(patches.count(), [&](size_t k) {
        grid::Grid patch;
        std::vector<uint32_t> vertices;
        grid::VertexInputs of_patch;
        patches.cut(k, patch, vertices);
        const size_t own = size_t(patch.stencils->own);
        material.shade(patch, of_patch, &log);
        m_request.stats.count.shader_evaluations += own * uint64_t(material.program().variants);
        const std::lock_guard lock(mutex);
        whole.add(of_patch, vertices, own, inputs);
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < own; i++)
                normals[vertices[i] + c * size_t(g.stride)] = patch.N[i + c * size_t(patch.stride)];
        facets = patch.facets;
    });
    g.N = std::move(normals);
    g.facets = facets;
}

void Preparer::say_of_values(const Location& where, uint64_t bad, uint64_t lost) const {
    if (bad > 0)
        m_request.journal.warning(where, std::to_string(bad) +
                                             " shader outputs were not finite and have been replaced");
    if (lost > 0)
        m_request.journal.warning(where,
                                  std::to_string(lost) +
                                      " shader outputs were beyond what is kept (radiance of emitters 1e15, "
                                      "other amounts 65504) and have been made smaller");
}

void Preparer::share_wall_time(double wall) const {
    const double dice = m_dice_time.load(), shade = m_shade_time.load(), store = m_store_time.load();
    const double share = wall / std::max(dice + shade + store, 1e-12);
    m_request.stats.time.dice_s += dice * share;
    m_request.stats.time.shade_s += shade * share;
    m_request.stats.time.store_s += store * share;
}

} // namespace kanuka::render
