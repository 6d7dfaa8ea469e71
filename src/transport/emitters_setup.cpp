// Emitting triangles: their slots, their hierarchy, or a table where one patch is all there is.
#include <cmath>
#include <numeric>

#include "transport/lights_setup.h"

namespace kanuka::transport {

namespace {

// Vose's alias method (1991).
void fill_alias(LightsData& own, std::span<const store::Emitter> emitters,
                const std::vector<int32_t>& sampled) {
    double total = 0;
    for (int32_t e : sampled)
        total += emitters[size_t(e)].power;
    const size_t n = sampled.size();
    own.alias.emitters = sampled;
    own.alias.probability.assign(n, 1.0f);
    own.alias.other.resize(n);
    std::iota(own.alias.other.begin(), own.alias.other.end(), 0);
    std::vector<double> scaled(n);
    std::vector<int> small, large;
    for (size_t i = 0; i < n; i++) {
        scaled[i] = emitters[size_t(sampled[i])].power / total * double(n);
        (scaled[i] < 1 ? small : large).push_back(int(i));
    }
    while (!small.empty() && !large.empty()) {
        const int s = small.back(), l = large.back();
        small.pop_back();
        own.alias.probability[size_t(s)] = float(scaled[size_t(s)]);
        own.alias.other[size_t(s)] = l;
        scaled[size_t(l)] -= 1 - scaled[size_t(s)];
        if (scaled[size_t(l)] < 1) {
            large.pop_back();
            small.push_back(l);
        }
    }
    for (int32_t e : sampled)
        own.alias.pdf_area[size_t(e)] =
            float(double(emitters[size_t(e)].power) / total / emitters[size_t(e)].area);
}

// What is in the hierarchy, or in the alias table, as a sphere: an estimate for LightChooser.
void fill_estimates(LightsView& view, std::span<const LightBound> sampled) {
    Bounds3f bounds;
    double power = 0;
    for (const LightBound& b : sampled)
        if (b.power > 0) {
            bounds.extend(b.center);
            power += double(b.power);
        }
    if (!bounds.empty()) {
        const Vec3f d = bounds.diagonal();
        view.emitter_center = bounds.center();
        view.emitter_radius2 = std::max(0.25f * dot(d, d), 1e-12f);
        view.emitter_power = float(power);
    }
}

LightBound bound_of(const store::Emitter& e, const float* placement, int32_t sets) {
    Vec3f p = e.p0, e1 = e.e1, e2 = e.e2;
    float side = e.flags & 1 ? -1.0f : 1.0f;
    if (placement) {
        const float* m = placement;
        const auto turn = [&](const Vec3f& v) {
            return Vec3f(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
                         m[8] * v.x + m[9] * v.y + m[10] * v.z);
        };
        p = turn(p) + Vec3f(m[3], m[7], m[11]);
        e1 = turn(e1), e2 = turn(e2);
        const Vec3f r0(m[0], m[1], m[2]), r1(m[4], m[5], m[6]), r2(m[8], m[9], m[10]);
        side *= std::copysign(1.0f, dot(r0, cross(r1, r2)));
    }
    const Vec3f n = cross(e1, e2), middle = (e1 + e2) * (1 / 3.0f);
    const float twice = length(n);
    LightBound b;
    b.center = p + middle;
    b.radius = std::max({length(middle), length(e1 - middle), length(e2 - middle)});
    b.axis = twice > 0 ? n * (side / twice) : Vec3f(0, 0, 1);
    b.cos_spread = 1;
    b.cos_reach = store::EmissionShape::reach_of(e.flags);
    b.power = twice > 0 && e.area > 0 ? e.power / e.area * 0.5f * twice : 0.0f;
    b.sets = sets;
    return b;
}

// Leaves for the triangles of a group and of what is placed in it, slot by slot.
class SlotFiller {
  public:
    SlotFiller(SceneData& data, const SceneInputs& in, std::vector<LightBound>& leaves)
        : m_slots(data.lights.slots), m_world_slots(data.view.lights.slots.in_world), m_in(in),
          m_leaves(leaves) {}

    void place(const bvh::GroupDesc& group, const float* transform, int first_slot) {
        if (group.emitters > 0) {
            int placement = -1;
            if (transform) {
                placement = int(m_slots.placements.size() / 12);
                m_slots.placements.insert(m_slots.placements.end(), transform, transform + 12);
            }
            fill(group, transform, placement, first_slot);
        }
        for (const auto& in : group.instances) {
            if (in.first_slot < 0)
                continue;
            const bvh::GroupDesc& child = m_in.groups[size_t(in.group)];
            for (size_t i = 0; i < in.places.size(); i++) {
                float m[12];
                const auto t = in.places[i];
                for (size_t r = 0; r < 3; r++)
                    for (size_t c = 0; c < 4; c++)
                        m[4 * r + c] = transform ? transform[4 * r] * t[c] + transform[4 * r + 1] * t[4 + c] +
                                                       transform[4 * r + 2] * t[8 + c] +
                                                       (c == 3 ? transform[4 * r + 3] : 0)
                                                 : t[4 * r + c];
                place(child, m, first_slot + in.first_slot + int(i) * child.slots);
            }
        }
    }

  private:
    void fill(const bvh::GroupDesc& group, const float* transform, int placement, int first_slot) {
        for (const auto& range : group.shapes)
            for (int s = range.first; s < range.first + range.count; s++) {
                const store::ShapeRecord& shape = m_in.store->shapes()[size_t(s)];
                if (shape.emitter < 0 || shape.motion_segments > 0) // what changes its shape is hit by chance
                    continue;
                for (int e = shape.emitter; e < shape.emitter + store::emitter_count(shape); e++) {
                    const int slot = first_slot + e - group.first_emitter;
                    m_leaves[size_t(slot)] = bound_of(m_in.store->emitters()[size_t(e)], transform,
                                                      m_in.store->links_of(s).shone_sets);
                    if (placement >= 0) {
                        m_slots.emitter[size_t(slot - m_world_slots)] = e;
                        m_slots.placement[size_t(slot - m_world_slots)] = placement;
                    }
                }
            }
    }

    decltype(LightsData::slots)& m_slots;
    int m_world_slots;
    const SceneInputs& m_in;
    std::vector<LightBound>& m_leaves;
};

} // namespace

void fill_emitters(SceneData& data, const SceneInputs& in) {
    LightsView& view = data.view.lights;
    LightsData& own = data.lights;
    const std::span<const store::Emitter> emitters = in.store->emitters();
    const bvh::GroupDesc& world = in.groups.back();
    EmitterSlots& slots = view.slots;
    slots.count = world.slots;
    slots.in_world = world.emitters;
    slots.first_emitter = world.first_emitter;
    own.slots.emitter.assign(size_t(world.slots - world.emitters), 0);
    own.slots.placement.assign(size_t(world.slots - world.emitters), 0);
    std::vector<LightBound> leaves(size_t(world.slots));
    SlotFiller(data, in, leaves).place(world, nullptr, 0);
    slots.emitter = own.slots.emitter;
    slots.placement = own.slots.placement;
    slots.placements = own.slots.placements;
    for (const LightBound& b : leaves)
        own.slots.power.push_back(b.power);
    slots.power = own.slots.power;
    leaves.insert(leaves.end(), own.bounds.begin(), own.bounds.end());
    for (int k = 0; k < view.by_choice; k++) // choices of their own
        leaves[size_t(slots.count + k)].power = 0;
    std::vector<int32_t> sampled;
    for (size_t i = 0; i < leaves.size() && sampled.size() <= 2; i++)
        if (leaves[i].power > 0 && std::isfinite(leaves[i].power))
            sampled.push_back(int32_t(i));
    if (!sampled.empty()) {
        view.emitter_choice = 0;
        fill_estimates(view, leaves);
        if (sampled.size() <= 2 && sampled.back() < slots.in_world && !view.linked) {
            own.alias.pdf_area.assign(emitters.size() + 1, 0.0f);
            for (int32_t& slot : sampled)
                slot += slots.first_emitter;
            fill_alias(own, emitters, sampled);
        } else {
            own.tree = build_light_tree(leaves);
            view.keeps_normals = true;
        }
    }
    if (own.tree.empty() && own.alias.pdf_area.empty())
        own.alias.pdf_area.assign(emitters.size() + 1, 0.0f);
    view.tree = own.tree;
    view.alias = {own.alias.probability, own.alias.other, own.alias.emitters, own.alias.pdf_area};
}

} // namespace kanuka::transport
