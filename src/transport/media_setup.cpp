#include "transport/media_setup.h"

#include <algorithm>
#include <bit>

#include "grid/lobe_table.h"
#include "transport/majorants.h"
#include "transport/stage_medium.h"

namespace kanuka::transport {

namespace {

using grid::input_of, grid::LobeId;

bsdf::Phase<1> make_phase(LobeId lobe, const std::array<float, grid::Interior::MaxPhaseInputs>& in) {
    using enum grid::LobeId;
    using Kind = bsdf::PhaseKind;
    using F = Float<1>;
    // Peaks that no float resolves are no use: a mean cosine of 1 would be no scattering at all.
    const auto g = [](float x) { return F(std::clamp(x, -0.9995f, 0.9995f)); };
    bsdf::Phase<1> p;
    switch (lobe) {
    case DoubleHenyeyGreensteinPfrgb:
        p.kind = Kind::DoubleHenyeyGreenstein;
        p.g = g(in[input_of(DoubleHenyeyGreensteinPfrgb, "meanCosine")]);
        p.other_g = g(in[input_of(DoubleHenyeyGreensteinPfrgb, "otherMeanCosine")]);
        p.share = F(std::clamp(in[input_of(DoubleHenyeyGreensteinPfrgb, "share")], 0.0f, 1.0f));
        break;
    case RayleighPfrgb:
        p.kind = Kind::Rayleigh;
        break;
    case DrainePfrgb:
        p.kind = Kind::Draine;
        p.g = g(std::max(in[input_of(DrainePfrgb, "meanCosine")], 0.05f));
        p.alpha = F(std::max(in[input_of(DrainePfrgb, "alpha")], 0.0f));
        break;
    case MiePfrgb:
        p = bsdf::mie_phase(F(in[input_of(MiePfrgb, "diameter")]));
        break;
    default:
        const float mean = in[input_of(HenyeyGreensteinPfrgb, "meanCosine")];
        p.kind = mean == 0 ? Kind::Isotropic : Kind::HenyeyGreenstein;
        p.g = g(mean);
    }
    return p;
}

// Media around the camera, counted along a ray: those that it leaves and has not entered. By how far away
// their boundaries are.
struct Around {
    float distance;
    int32_t medium;
};
std::vector<Around> media_along(const SceneView& view, const Vec3f& o, const Vec3f& d) {
    constexpr int MostSurfaces = 1000;
    std::vector<Around> around;
    std::vector<int32_t> entered;
    bvh::RayPacket<1> ray;
    bvh::HitPacket<1> hit;
    for (int c = 0; c < 3; c++)
        ray.o[c] = Float<1>(o[c]), ray.d[c] = Float<1>(d[c]);
    ray.t_max = Float<1>(1e30f);
    ray.active = Mask<1>(true);
    ray.seed = Int<1>(0);
    for (int k = 0; k < MostSurfaces; k++) {
        view.geometry.ray_query.intersect(ray, hit);
        if (!hit.hit[0])
            break;
        const auto* shape = reinterpret_cast<const store::ShapeRecord*>(view.geometry.shapes +
                                                                        hit.shape[0] * store::ShapeWords);
        if (shape->interior >= 0) {
            const auto open = std::find(entered.begin(), entered.end(), shape->interior);
            if (hits_outside(view, hit, ray.d, Mask<1>(true))[0])
                entered.push_back(shape->interior);
            else if (open != entered.end())
                entered.erase(open);
            else
                around.push_back({hit.t[0], shape->interior});
        }
        ray.t_min = beyond(ray.o, ray.d, hit.t);
    }
    return around;
}

// Several rays: the surfaces of media may have holes. What most of them say holds.
void place_camera(SceneView& view, Journal& journal) {
    static constexpr float Directions[][3] = {{0.267f, 0.535f, 0.802f},    {-0.811f, 0.324f, 0.487f},
                                              {0.445f, -0.845f, 0.297f},   {0.557f, 0.371f, -0.743f},
                                              {-0.549f, -0.618f, -0.563f}, {-0.309f, 0.927f, -0.213f},
                                              {0.905f, -0.302f, -0.302f}};
    const size_t rays = std::size(Directions);
    const float* m = view.camera.motion.empty() ? view.camera.render_from_camera : view.camera.motion.data();
    const Vec3f o(m[3], m[7], m[11]);
    std::vector<std::vector<Around>> seen;
    for (const auto& d : Directions)
        seen.push_back(media_along(view, o, normalize(Vec3f(d[0], d[1], d[2]))));
    std::vector<Around> inside;
    bool doubtful = false;
    for (int32_t medium = 0; medium < int32_t(view.media.phases.size()); medium++) {
        std::vector<std::vector<float>> times(rays); // distances, a ray each
        std::vector<size_t> counts;
        for (size_t r = 0; r < rays; r++) {
            for (const Around& a : seen[r])
                if (a.medium == medium)
                    times[r].push_back(a.distance);
            counts.push_back(times[r].size());
        }
        std::sort(counts.begin(), counts.end());
        const size_t count = counts[rays / 2];
        doubtful |= counts.front() != counts.back();
        for (size_t k = 0; k < count; k++) {
            float nearest = 1e30f;
            for (const auto& t : times)
                if (k < t.size())
                    nearest = std::min(nearest, t[k]);
            inside.push_back({nearest, medium});
        }
    }
    if (doubtful)
        journal.warning({},
                        std::string("the camera is near a surface with an inside that is not closed: it ") +
                            (inside.empty() ? "is taken to be outside" : "is taken to be inside") +
                            ", as most directions say; close the surface, or move the camera");
    // Entered last what is left first.
    std::stable_sort(inside.begin(), inside.end(),
                     [](const Around& a, const Around& b) { return a.distance > b.distance; });
    MediaStack<1> stack;
    for (auto& k : stack.at)
        k = Int<1>(-1);
    for (const Around& a : inside)
        stack.enter(view, Int<1>(a.medium), Mask<1>(true));
    for (int k = 0; k < MediaStack<1>::Most; k++)
        view.media.around_camera[k] = stack.at[k][0];
}

int32_t add_field(std::vector<float>& fields, const store::Interior& interior) {
    const store::DensityField& field = *interior.field;
    const Majorants majorants =
        make_majorants(field, interior.absorption_spectrum[3] + interior.scattering_spectrum[3]);
    const size_t at = fields.size();
    fields.resize(at + FieldRow::Words);
    float* row = fields.data() + at;
    std::copy(field.unit_from_render.begin(), field.unit_from_render.end(), row);
    for (size_t c = 0; c < 3; c++)
        row[FieldRow::SizeX + c] = float(field.size[c]),
                              row[FieldRow::CellsX + c] = float(majorants.cells[c]);
    row[FieldRow::Shape] = float(field.shape);
    fields.insert(fields.end(), field.density.begin(), field.density.end());
    fields.insert(fields.end(), majorants.values.begin(), majorants.values.end());
    fields.resize((fields.size() + 3) / 4 * 4);
    return int32_t(at);
}

} // namespace

void fill_media(SceneData& data, const store::Store& store, int volume_depth, Journal& journal) {
    constexpr size_t Stride = size_t(1) << MediumRow::Shift;
    SceneView& scene = data.view;
    MediaView& view = scene.media;
    MediaData& own = data.media;
    scene.settings.volume_depth = std::clamp(volume_depth, 0, 60000);
    own.rows.assign(Stride * (store.interiors().size() + 1), 0.0f);
    own.rows[MediumRow::Ior] = 1;
    own.rows[MediumRow::Priority] = -1e30f; // nothing gives way to everything
    own.rows[MediumRow::Field] = std::bit_cast<float>(-1);
    for (size_t k = 0; k < store.interiors().size(); k++) {
        const store::Interior& from = store.interiors()[k];
        own.phases.push_back(make_phase(from.phase, from.phase_inputs));
        float* row = own.rows.data() + Stride * (k + 1);
        std::copy(from.absorption_spectrum.begin(), from.absorption_spectrum.end(),
                  row + MediumRow::Absorption);
        std::copy(from.scattering_spectrum.begin(), from.scattering_spectrum.end(),
                  row + MediumRow::Scattering);
        row[MediumRow::Ior] = from.ior;
        row[MediumRow::Priority] = std::clamp(from.priority, -1e6f, 1e6f);
        // Where it is thicker here than there, collisions are sampled even if it only absorbs.
        row[MediumRow::Scatters] = from.scatters || from.field ? 1.0f : 0.0f;
        row[MediumRow::Field] = std::bit_cast<float>(from.field ? add_field(own.fields, from) : -1);
        if (from.phase == LobeId::RayleighPfrgb)
            row[MediumRow::Angstrom] = std::clamp(
                from.phase_inputs[input_of(LobeId::RayleighPfrgb, "angstromExponent")], 0.0f, 8.0f);
        view.scatters |= from.scatters || from.field;
        view.tracked |= from.absorbs;
        view.has_fog |= from.scatters && !from.field;
    }
    for (const bsdf::MaterialCode& code : data.materials) {
        own.clear.push_back(code.leaves == 0);
        own.straight.push_back(code.straight != 0);
        view.thin_walls |= code.straight != 0;
        if (code.air >= 0 && std::ranges::find(own.airs, code.air) == own.airs.end())
            own.airs.push_back(code.air);
    }
    view.phases = own.phases;
    view.rows = own.rows;
    view.fields = own.fields;
    view.clear = own.clear;
    view.straight = own.straight;
    view.airs = own.airs;
    view.tracked |= view.thin_walls;
    if (own.phases.empty())
        return;
    for (const store::ShapeRecord& s : store.shapes())
        view.clear_boundaries |= s.interior >= 0 && s.emitter < 0 && own.clear[size_t(s.program)];
    view.tracked |= view.scatters || view.clear_boundaries || own.phases.size() > 1;
    scene.settings.keeps_ratios |= view.scatters;
    place_camera(scene, journal);
}

} // namespace kanuka::transport
