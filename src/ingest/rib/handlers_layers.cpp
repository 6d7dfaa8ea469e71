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

// The shader is the last layer; those before it are its layers. A Surface has no handle: a ShaderLayer after
// it begins anew.
void shader_layer(Context& c, Call& call) {
    std::optional<ShaderRef>* slot = slot_of(c, call);
    if (!slot)
        return;
    const std::string type = call.text(0);
    ShaderRef next = c.shader(call, 1);
    next.handle = call.text(2);
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
