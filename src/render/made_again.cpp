#include "render/made_again.h"

#include <set>

#include "scene/digest.h"

namespace kanuka::render {

namespace {

uint64_t key_of(const scene::Primitive& primitive) {
    return primitive.node != scene::NodeId::None ? uint64_t(primitive.node) : uint64_t(primitive.id);
}

std::string name_of(const scene::Primitive& primitive) {
    return primitive.attributes ? primitive.attributes->name : "";
}

// Visits what shaders have read, piece by piece: visit(piece, what it is called).
template <class Visit>
void each_piece(const shade::SpacesRead& read, const Visit& visit) {
    for (const auto& transform : read.transforms)
        visit(shade::SpacesRead{.transforms = {transform}},
              "space " + transform.first + " from " + transform.second);
    if (read.eye)
        visit(shade::SpacesRead{.eye = true}, std::string("eye"));
    if (read.world)
        visit(shade::SpacesRead{.world = true}, std::string("lights"));
    for (const std::string& file : read.files)
        visit(shade::SpacesRead{.files = {file}}, "texture " + file);
}

// ---- attributes

using Says = std::vector<std::string>;

void compare(const std::string& slot, const std::optional<scene::ShaderRef>& before,
             const std::optional<scene::ShaderRef>& now, Says& says) {
    if (!before && !now)
        return;
    if (!before || !now || before->name != now->name) {
        says.push_back(slot + " shader");
        return;
    }
    std::set<std::string> names;
    for (const scene::ValueList* list : {&before->parameters, &now->parameters})
        for (const scene::Value& value : list->values)
            names.insert(value.name);
    for (const std::string& name : names) {
        const scene::Value *a = before->parameters.find(name), *b = now->parameters.find(name);
        if (!a || !b || digest_of(*a) != digest_of(*b))
            says.push_back(slot + " parameter " + name);
    }
    if (digest_of(before->coshaders) != digest_of(now->coshaders))
        says.push_back("co-shaders");
}

void compare(const scene::Attributes& before, const scene::Attributes& now, Says& says) {
    compare("surface", before.surface, now.surface, says);
    compare("displacement", before.displacement, now.displacement, says);
    compare("interior", before.interior, now.interior, says);
    compare("exterior", before.exterior, now.exterior, says);
    compare("atmosphere", before.atmosphere, now.atmosphere, says);
    compare("area light", before.area_light, now.area_light, says);
    if (digest_of(before.coshaders) != digest_of(now.coshaders))
        says.push_back("co-shaders");
    // What is looked at by itself is the same in what is left of both.
    scene::Attributes a = before, b = now;
    const auto look_at = [&](auto member, const char* name) {
        if (!(a.*member == b.*member))
            says.push_back(std::string("attribute ") + name);
        a.*member = b.*member;
    };
    using A = scene::Attributes;
    look_at(&A::color, "color");
    look_at(&A::opacity, "opacity");
    look_at(&A::color_spectrum, "color_spectrum");
    look_at(&A::shading_rate, "shading_rate");
    look_at(&A::sides, "sides");
    look_at(&A::reverse_orientation, "reverse_orientation");
    look_at(&A::displacement_bound, "displacement_bound");
    look_at(&A::texture_coordinates, "texture_coordinates");
    look_at(&A::visible_camera, "visible_camera");
    look_at(&A::dice_flatness, "dice_flatness");
    look_at(&A::shadow_terminator, "shadow_terminator");
    look_at(&A::matte, "matte");
    look_at(&A::lights_only, "lights_only");
    look_at(&A::lights_off, "lights_off");
    look_at(&A::shadows_off, "shadows_off");
    a.surface = b.surface, a.displacement = b.displacement, a.interior = b.interior, a.exterior = b.exterior;
    a.atmosphere = b.atmosphere, a.area_light = b.area_light, a.coshaders = b.coshaders, a.name = b.name;
    if (digest_of(a) != digest_of(b))
        says.push_back("attributes");
}

} // namespace

Digest PageInputs::content() const {
    return digest_of(options, rates, lens, shape, place, cameras, oracle, inside_out, material,
                     of_attributes);
}

void PageInputs::note_read(const shade::SpacesRead& what, const shade::Material& here) {
    read = what;
    of_read.clear();
    each_piece(read, [&](const shade::SpacesRead& piece, const std::string&) {
        of_read.push_back(here.digest_of(piece));
    });
}

void MadeAgain::begin(std::string all) {
    constexpr uint64_t Remembered = 4; // makings, some of which may have been cancelled
    m_is_first = m_known.empty();
    m_making++;
    std::erase_if(m_known, [&](const auto& known) { return known.second.making + Remembered < m_making; });
    m_all = std::move(all);
    m_reasons.clear();
    m_place.clear();
}

std::vector<std::string> MadeAgain::reasons_for(const scene::Primitive& primitive, const PageInputs& now,
                                                const shade::Material& here, bool had_no_room) const {
    if (m_is_first)
        return {"first"};
    if (!m_all.empty())
        return {m_all};
    if (had_no_room)
        return {"no room"};
    const auto found = m_known.find(key_of(primitive));
    if (found == m_known.end() || found->second.name != name_of(primitive))
        return {"new"};
    const PageInputs& before = found->second.inputs;
    Says says;
    const auto differs = [&](const auto& a, const auto& b, const char* why) {
        if (a != b)
            says.push_back(why);
    };
    differs(before.shape, now.shape, "shape");
    static const scene::Attributes none;
    if (before.of_attributes != now.of_attributes)
        compare(before.attributes ? *before.attributes : none, now.attributes ? *now.attributes : none, says);
    differs(before.options, now.options, "options");
    differs(before.rates, now.rates, "rates and tolerances");
    differs(before.lens, now.lens, "lens or resolution");
    differs(before.place, now.place, "turned or scaled");
    differs(before.cameras, now.cameras, "camera step");
    differs(before.oracle, now.oracle, "oracle");
    differs(before.inside_out, now.inside_out, "solid");
    size_t i = 0;
    const size_t said = says.size();
    each_piece(before.read, [&](const shade::SpacesRead& piece, const std::string& what) {
        if (here.digest_of(piece) != before.of_read[i++])
            says.push_back(what);
    });
    // A material depends on its textures as well. Else a shader's text has changed, or what it asks for.
    if (before.of_attributes == now.of_attributes && says.size() == said)
        differs(before.material, now.material, "shader, or options and lights that it asks for");
    if (says.empty())
        says.push_back("other");
    return says;
}

void MadeAgain::note(const scene::Primitive& primitive, PageInputs now,
                     const std::vector<std::string>& reasons) {
    for (const std::string& each : reasons) {
        const bool is_one_too_many = m_reasons.size() >= MostReasons && !m_place.contains(each);
        const std::string& why = is_one_too_many ? "other" : each;
        const auto [place, is_new] = m_place.try_emplace(why, m_reasons.size());
        if (is_new)
            m_reasons.push_back({why, 0, name_of(primitive), primitive.id, primitive.where});
        m_reasons[place->second].primitives++;
    }
    m_known[key_of(primitive)] = {name_of(primitive), std::move(now), m_making};
}

} // namespace kanuka::render
