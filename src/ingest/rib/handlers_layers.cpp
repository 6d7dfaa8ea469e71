// Shaders of several layers, and what connects them.

#include <algorithm>
#include <utility>

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"
#include "scene/layers.h"

namespace kanuka::ingest::handlers {

using scene::ShaderRef;

// The slot of a kind of shader; null = reported.
static std::optional<ShaderRef>* slot_of(Context& c, const Call& call) {
    const std::string& type = call.text(0);
    if (type == "surface")
        return &c.attributes.edit(FieldSurface).surface;
    if (type == "displacement")
        return &c.attributes.edit(FieldDisplacement).displacement;
    if (type == "atmosphere")
        return &c.attributes.edit(FieldAtmosphere).atmosphere;
    if (type == "interior")
        return &c.attributes.edit(FieldInterior).interior;
    if (type == "exterior")
        return &c.attributes.edit(FieldExterior).exterior;
    c.reports.once(
        Severity::Warning, "ShaderLayer " + type, call.where,
        std::string(call.spec->name) + " \"" + type +
            "\" was left out: layers are of surface, displacement, atmosphere, interior or exterior");
    return nullptr;
}

// ---- deformations -----------------------------------------------------------------------------------

// RISpec 3.1's Deformation changes P before it is displaced: a layer of the displacement that runs before all
// others.
constexpr std::string_view Deforms = ":deformation";

static bool deforms(const ShaderRef& shader) {
    return shader.handle.starts_with(Deforms);
}

// Those of a displacement, in the order in which they run.
static std::vector<ShaderRef> deformations(const std::optional<ShaderRef>& displacement) {
    std::vector<ShaderRef> all;
    if (!displacement)
        return all;
    for (const std::string& handle : scene::layers(*displacement))
        for (const ShaderRef& layer : displacement->coshaders)
            if (layer.handle == handle && deforms(layer))
                all.push_back(layer);
    if (deforms(*displacement)) {
        all.push_back(*displacement);
        all.back().coshaders.clear();
        std::erase_if(all.back().parameters.values,
                      [](const scene::Value& v) { return v.name == ":layers"; });
    }
    return all;
}

// Makes them the first layers of a displacement; where there is none, the last is the shader.
static void deform(std::optional<ShaderRef>& displacement, std::vector<ShaderRef> first) {
    if (first.empty())
        return;
    if (!displacement) {
        displacement = std::move(first.back());
        first.pop_back();
    }
    std::vector<std::string> order;
    for (const ShaderRef& layer : first)
        order.push_back(layer.handle);
    for (const std::string& handle : scene::layers(*displacement))
        order.push_back(handle);
    for (ShaderRef& layer : first)
        displacement->coshaders.push_back(std::move(layer));
    if (!order.empty())
        displacement->parameters.set(scene::texts(":layers", std::move(order), displacement->where));
}

void put_displacement(Context& c, std::optional<ShaderRef>&& displacement) {
    std::optional<ShaderRef>& slot = c.attributes.edit(FieldDisplacement).displacement;
    std::vector<ShaderRef> first = deformations(slot);
    slot = std::move(displacement);
    deform(slot, std::move(first));
}

// The newest is the nearest to the object: it runs first, as the newest transformation does.
void deformation(Context& c, Call& call) {
    std::optional<ShaderRef>& slot = c.attributes.edit(FieldDisplacement).displacement;
    std::vector<ShaderRef> first = deformations(slot);
    if (call.text(0).empty() || call.text(0) == "null") { // ends them all
        if (slot && deforms(*slot))
            slot.reset();
        if (slot) {
            std::erase_if(slot->coshaders, deforms);
            std::vector<std::string> rest = scene::layers(*slot);
            std::erase_if(rest, [](const std::string& handle) { return handle.starts_with(Deforms); });
            slot->parameters.set(scene::texts(":layers", std::move(rest), slot->where));
        }
        return;
    }
    constexpr size_t Most = 64;
    if (first.size() >= Most) {
        c.reports.once(Severity::Error, "deformations", call.where,
                       "Deformation \"" + call.text(0) + "\" was left out: " + std::to_string(Most) +
                           " are in force; end them by AttributeEnd or Deformation \"null\"");
        return;
    }
    ShaderRef newest = c.shader(call, 0);
    newest.handle = std::string(Deforms) + std::to_string(first.size() + 1);
    if (slot && deforms(*slot)) { // nothing but deformations
        slot.reset();
        first.insert(first.begin(), std::move(newest));
        deform(slot, std::move(first));
    } else {
        deform(slot, {std::move(newest)});
    }
}

// ---- layers -----------------------------------------------------------------------------------------

// The shader is the last layer; those before it are its layers. A Surface has no handle: a ShaderLayer after
// it begins anew.
void shader_layer(Context& c, Call& call) {
    std::optional<ShaderRef>* slot = slot_of(c, call);
    if (!slot)
        return;
    const std::string type = call.text(0);
    ShaderRef next = c.shader(call, 1);
    next.handle = call.text(2);
    std::vector<ShaderRef> first; // that stay where a network begins anew
    if (type == "displacement" && *slot && ((*slot)->handle.empty() || deforms(**slot))) {
        first = deformations(*slot);
        slot->reset();
    }
    if (*slot && !(*slot)->handle.empty()) {
        ShaderRef before = std::move(**slot);
        next.coshaders = std::exchange(before.coshaders, {});
        if (const scene::Value* list = before.parameters.find(":layers"))
            next.parameters.set(*list);
        std::erase_if(before.parameters.values, [](const scene::Value& v) { return v.name == ":layers"; });
        scene::add_layer(next, std::move(before));
        std::vector<std::string> layers = scene::layers(next); // a layer of the same name is replaced
        std::erase(layers, next.handle);
        std::erase_if(next.coshaders, [&](const ShaderRef& l) { return l.handle == next.handle; });
        next.parameters.set(scene::texts(":layers", std::move(layers), next.where));
        if (type != "surface" && type != "displacement")
            c.reports.once(
                Severity::Warning, "ShaderLayer of " + type, call.where,
                "ShaderLayer \"" + type +
                    "\": of several layers the last is the shader; surfaces and displacements alone "
                    "have layers");
    }
    *slot = std::move(next);
    deform(*slot, std::move(first));
}

void connect_shader_layers(Context& c, Call& call) {
    std::optional<ShaderRef>* slot = slot_of(c, call);
    if (!slot)
        return;
    const std::string &from = call.text(1), &output = call.text(2), &to = call.text(3), &input = call.text(4);
    const auto layer = [&](const std::string& handle) -> ShaderRef* {
        if (!*slot || (*slot)->handle.empty())
            return nullptr;
        if ((*slot)->handle == handle)
            return &**slot;
        for (ShaderRef& l : (*slot)->coshaders)
            if (l.handle == handle)
                return &l;
        return nullptr;
    };
    for (const std::string& handle : {from, to})
        if (!layer(handle)) {
            std::string have;
            if (*slot && !(*slot)->handle.empty()) {
                for (const std::string& l : scene::layers(**slot))
                    have += l + ", ";
                have += (*slot)->handle;
            }
            c.reports.error("no layer", call.where,
                            "ConnectShaderLayers was left out: there is no " + call.text(0) + " layer \"" +
                                handle + "\"; there " +
                                (have.empty() ? "are none: ShaderLayer makes them" : "are " + have));
            return;
        }
    if (from == to) {
        c.reports.error("layer to itself", call.where,
                        "ConnectShaderLayers was left out: layer \"" + from + "\" cannot feed itself");
        return;
    }
    scene::connect(*layer(to), input, from, output, call.where);
}

} // namespace kanuka::ingest::handlers
