// An instance inside of a solid becomes part of it: what the object holds is copied into the solid's tree,
// since instances have trees of their own.
#include "ingest/rib/context.h"
#include "scene/place_shaders.h"

namespace kanuka::ingest {

struct Context::SolidInstance {
    int object;
    std::shared_ptr<const scene::Attributes> attributes; // what members inherit
    uint64_t set;
    Transform place;
    std::vector<TransformKey> keys;
    int solid; // that it is part of
};

void Context::add_to_solid(int object, const Location& where) {
    size_t left = MostInSolid;
    if (!expand({object, attributes.shared, attributes.set, ctm, ctm_keys, attributes.solid}, left))
        reports.error("ObjectInstance in a solid", where,
                      "ObjectInstance in a solid holds more than " + std::to_string(MostInSolid) +
                          " primitives; the rest was left out");
}

bool Context::expand(const SolidInstance& instance, size_t& left) {
    using Kind = scene::Solid::Kind;
    // Solids of the object below the one that the instance stands in.
    const int first = int(solids().size());
    {
        const std::vector<scene::Solid> own = objects.record(instance.object).solids;
        for (const scene::Solid& s : own)
            add_solid({s.kind, s.parent < 0 ? instance.solid : first + s.parent});
    }
    int loose = solids()[size_t(instance.solid)].kind == Kind::Primitive ? instance.solid : -1;
    // Attributes by those of members: primitives that shared them share them on.
    std::map<std::pair<const scene::Attributes*, uint64_t>, std::shared_ptr<const scene::Attributes>> looks;
    for (size_t i = 0; i < objects.record(instance.object).members.size(); i++) {
        const ObjectRecord::Member member = objects.record(instance.object).members[i]; // buffers are shared
        auto& look = looks[{member.primitive.attributes.get(), member.set}];
        if (!look) {
            auto own = std::make_shared<scene::Attributes>(*member.primitive.attributes);
            place_shaders(instance.place, *own);
            look = inherit(instance.attributes, own, member.set);
        }
        const Transform place = instance.place * member.primitive.world_from_object;
        const std::vector<TransformKey> inner =
            member.primitive.motion ? member.primitive.motion->places : std::vector<TransformKey>();
        const std::vector<TransformKey> keys =
            inner.empty() && instance.keys.empty()
                ? std::vector<TransformKey>()
                : compose(instance.keys, instance.place, inner, member.primitive.world_from_object);
        const uint64_t set = instance.set | member.set;
        // Surfaces that are in no solid of the object's bound one together.
        const bool in_solid = member.primitive.solid >= 0;
        if (!in_solid && member.object < 0 && loose < 0) {
            loose = add_solid({Kind::Primitive, instance.solid});
        }
        if (left == 0)
            return false;
        left--;
        if (member.object >= 0) {
            const int parent = in_solid ? first + member.primitive.solid : instance.solid;
            if (!expand({member.object, look, set, place, keys, parent}, left))
                return false;
            continue;
        }
        scene::Primitive p = member.primitive;
        p.world_from_object = place;
        p.attributes = look;
        p.id = m_next_id++;
        p.solid = in_solid ? first + member.primitive.solid : loose;
        if (!keys.empty() || p.motion) {
            auto motion =
                p.motion ? std::make_shared<scene::Motion>(*p.motion) : std::make_shared<scene::Motion>();
            motion->places = keys;
            p.motion = std::move(motion);
        }
        if (m_open_object >= 0)
            objects.record(m_open_object).members.push_back({std::move(p), -1, set});
        else
            m_editor->add(std::move(p));
    }
    return true;
}

} // namespace kanuka::ingest
