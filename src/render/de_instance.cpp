#include "render/de_instance.h"

#include "scene/place_shaders.h"
#include "scene/text_column.h"

namespace kanuka::render {

namespace {

size_t count_in(const scene::Scene& scene, size_t first, const std::vector<scene::Group::Instances>& all) {
    size_t count = 0;
    for (const scene::Group::Instances& in : all)
        if (are_unique(in) && size_t(in.group) >= first) {
            const scene::Group& group = scene.groups[size_t(in.group) - first];
            count += in.count() * (group.primitives.size() + count_in(scene, first, group.instances));
        }
    return count;
}

} // namespace

Transform place_of(const scene::Group::Instances& in, size_t i) {
    Transform t;
    for (size_t k = 0; k < 12; k++)
        t.m[k / 4][k % 4] = double(in.transforms[12 * i + k]);
    return t;
}

scene::Variation one_of(const scene::Variation& all, size_t i) {
    const auto one = [i](const scene::Buffer<float>& of, size_t components) {
        if (of.size() <= components)
            return of;
        const float* first = of.data() + components * i;
        return scene::Buffer<float>(std::vector<float>(first, first + components));
    };
    scene::Variation own{one(all.variant, 1), one(all.tint, 3), one(all.roughness, 1), {}};
    for (const scene::Value& value : all.primvars.values) {
        own.primvars.values.push_back(value);
        scene::Value& its = own.primvars.values.back();
        its.detail = scene::Detail::Constant;
        if (!value.ints.empty()) {
            const auto texts = scene::texts_of(value, i);
            its.strings = std::vector<std::string>(texts.begin(), texts.end());
            its.ints = {};
        }
        its.floats = one(value.floats, scene::width_of(value));
    }
    return own;
}

size_t count_unique(const scene::Scene& scene, size_t first) {
    return count_in(scene, first, scene.instances);
}

std::vector<scene::Primitive> DeInstancer::copies(const scene::Group& group,
                                                  const Transform& world_from_group,
                                                  const scene::Variation& own) {
    std::map<const scene::Attributes*, std::shared_ptr<const scene::Attributes>> placed;
    std::vector<scene::Primitive> made = group.primitives;
    for (scene::Primitive& p : made) {
        p.node = scene::NodeId::None;
        p.world_from_object = world_from_group * p.world_from_object;
        if (p.motion && !p.motion->places.empty()) {
            auto motion = std::make_shared<scene::Motion>(*p.motion);
            for (TransformKey& key : motion->places)
                key.transform = world_from_group * key.transform;
            p.motion = std::move(motion);
        }
        if (!own.variant.empty() || (p.attributes && p.attributes->variants > 1)) {
            scene::Value variant{
                .name = "variant", .type = scene::Type::Float, .detail = scene::Detail::Constant};
            variant.floats = std::vector<float>{own.variant.empty() ? 0.0f : own.variant[0]};
            p.primvars.set(std::move(variant));
        }
        for (const scene::Value& value : own.primvars.values)
            if (!p.primvars.find(value.name))
                p.primvars.set(value);
        if (!p.attributes)
            continue;
        std::shared_ptr<const scene::Attributes>& here = placed[p.attributes.get()];
        if (!here) {
            auto there = std::make_shared<scene::Attributes>(*p.attributes);
            scene::place_shaders(world_from_group, *there);
            there->atmosphere = p.attributes->atmosphere; // air stays in the world
            there->variants = 1;
            here = std::move(there);
            m_declared[here] = p.attributes;
        }
        p.attributes = here;
    }
    return made;
}

const scene::Attributes* DeInstancer::declared(const scene::Attributes* attributes) const {
    const std::shared_ptr<const scene::Attributes> key(std::shared_ptr<const void>(), attributes);
    const auto found = m_declared.find(key);
    return found == m_declared.end() ? attributes : found->second.get();
}

} // namespace kanuka::render
