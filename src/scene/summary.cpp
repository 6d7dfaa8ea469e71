#include "scene/summary.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "scene/bounds.h"
#include "scene/counts.h"

namespace kanuka::scene {

namespace {

struct Collector {
    Summary& s;
    std::set<const Attributes*> states;

    void count(const Primitive& p) {
        s.by_kind[std::string(kind_name(p.geometry))]++;
        s.moving_primitives += p.motion != nullptr;
        for (const Value& v : p.primvars.values) {
            s.value_bytes += 4 * (v.floats.size() + v.ints.size());
            for (const std::string& text : v.strings)
                s.value_bytes += text.size();
            if (v.name == "P" || v.name == "Pw")
                s.control_points += v.items();
        }
        if (const auto* m = std::get_if<PolygonMesh>(&p.geometry)) {
            s.faces += !m->loops_per_face.empty()      ? m->loops_per_face.size()
                       : !m->vertices_per_loop.empty() ? m->vertices_per_loop.size()
                                                       : m->vertices.size() / 3;
            s.value_bytes +=
                4 * (m->loops_per_face.size() + m->vertices_per_loop.size() + m->vertices.size());
        } else if (const auto* d = std::get_if<SubdivisionMesh>(&p.geometry)) {
            s.faces += d->vertices_per_face.size();
            s.value_bytes += 4 * (d->vertices_per_face.size() + d->vertices.size());
        } else if (const auto* c = std::get_if<Curves>(&p.geometry)) {
            s.curves += c->vertices_per_curve.size();
            s.value_bytes += 4 * c->vertices_per_curve.size();
        }
        if (!p.attributes)
            return;
        states.insert(p.attributes.get());
        const Attributes& a = *p.attributes;
        s.surfaces[a.surface ? a.surface->name : "(default)"]++;
        if (a.displacement)
            s.displacements[a.displacement->name]++;
        if (a.interior)
            s.interiors[a.interior->name]++;
        s.area_light_primitives += a.area_light.has_value();
    }
};

nlohmann::ordered_json counts_json(const std::map<std::string, size_t>& counts) {
    nlohmann::ordered_json j = nlohmann::ordered_json::object();
    for (const auto& [name, n] : counts)
        j[name] = n;
    return j;
}

std::string counts_text(const std::map<std::string, size_t>& counts) {
    std::string s;
    for (const auto& [name, n] : counts)
        s += (s.empty() ? "" : ", ") + name + " " + std::to_string(n);
    return s.empty() ? "none" : s;
}

std::string number(double v) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.6g", v);
    return buffer;
}

} // namespace

Summary summarize(const Scene& scene) {
    Summary s;
    s.file = scene.file;
    s.options = scene.options;
    s.camera = scene.camera;
    s.primitives = scene.primitives.size();
    s.groups = scene.groups.size();
    s.lights = scene.lights.size();
    s.bounds = bounds(scene);
    Collector collect{s, {}};
    for (const Primitive& p : scene.primitives)
        collect.count(p);
    // Children have lower indices than their parents: one pass up gives every group's size.
    std::vector<size_t> sizes(scene.groups.size());
    const auto add = [&](const Group::Instances& instances, size_t& size, size_t below) {
        if (instances.group >= 0 && size_t(instances.group) < below)
            size += instances.count() * sizes[size_t(instances.group)];
    };
    for (size_t g = 0; g < scene.groups.size(); g++) {
        const Group& group = scene.groups[g];
        s.group_primitives += group.primitives.size();
        sizes[g] = group.primitives.size();
        for (const Primitive& p : group.primitives)
            collect.count(p);
        for (const Group::Instances& instances : group.instances)
            add(instances, sizes[g], g);
    }
    for (const Group::Instances& instances : scene.instances) {
        s.instances += instances.count();
        s.moving_instances += instances.moves() ? instances.count() : 0;
        add(instances, s.instanced_primitives, scene.groups.size());
    }
    s.attribute_states = collect.states.size();
    for (const ShaderRef& light : scene.light_shaders)
        s.light_shaders[light.name]++;
    for (const auto& [name, transform] : scene.coordinate_systems)
        s.coordinate_systems.push_back(name);
    return s;
}

std::string to_json(const Summary& s, int indent) {
    nlohmann::ordered_json j;
    j["file"] = s.file;
    j["primitives"] = {{"count", s.primitives},
                       {"by_kind", counts_json(s.by_kind)},
                       {"control_points", s.control_points},
                       {"faces", s.faces},
                       {"curves", s.curves},
                       {"value_bytes", s.value_bytes}};
    j["instances"] = {{"groups", s.groups},
                      {"group_primitives", s.group_primitives},
                      {"count", s.instances},
                      {"primitives", s.instanced_primitives}};
    if (s.bounds.empty())
        j["bounds"] = nullptr;
    else
        j["bounds"] = {{s.bounds.lo.x, s.bounds.lo.y, s.bounds.lo.z},
                       {s.bounds.hi.x, s.bounds.hi.y, s.bounds.hi.z}};
    j["shaders"] = {{"surface", counts_json(s.surfaces)},
                    {"displacement", counts_json(s.displacements)},
                    {"interior", counts_json(s.interiors)}};
    j["lights"] = {{"shaders", counts_json(s.light_shaders)},
                   {"analytic", s.lights},
                   {"area_light_primitives", s.area_light_primitives}};
    j["attribute_states"] = s.attribute_states;
    j["coordinate_systems"] = s.coordinate_systems;
    j["camera"] = {{"projection", std::string(kind_of(s.camera.projection).name)},
                   {"fov", s.camera.fov},
                   {"near_clip", s.camera.near_clip},
                   {"far_clip", s.camera.far_clip},
                   {"f_stop", s.camera.f_stop},
                   {"focal_length", s.camera.focal_length},
                   {"focal_distance", s.camera.focal_distance},
                   {"blades", s.camera.blades},
                   {"blade_rotation", s.camera.blade_rotation},
                   {"squeeze", s.camera.squeeze},
                   {"moves", s.camera.motion.size() > 1},
                   {"camera_from_world", s.camera.camera_from_world.m}};
    if (s.camera.screen_window)
        j["camera"]["screen_window"] = *s.camera.screen_window;
    const Options& o = s.options;
    j["options"] = {{"width", o.width},
                    {"height", o.height},
                    {"pixel_aspect", o.pixel_aspect},
                    {"crop", o.crop},
                    {"filter", o.filter},
                    {"filter_width", {o.filter_width[0], o.filter_width[1]}},
                    {"exposure_gain", o.exposure_gain},
                    {"exposure_gamma", o.exposure_gamma},
                    {"samples", o.samples},
                    {"max_depth", o.max_depth},
                    {"volume_depth", o.volume_depth},
                    {"integrator", o.integrator},
                    {"geometry_tolerance", o.geometry_tolerance},
                    {"normal_tolerance", o.normal_tolerance},
                    {"seed", o.seed},
                    {"shutter", {o.shutter_open, o.shutter_close}},
                    {"shutter_opening", o.shutter_opening},
                    {"shader_path", o.shader_path},
                    {"texture_path", o.texture_path},
                    {"archive_path", o.archive_path}};
    auto displays = nlohmann::ordered_json::array();
    for (const Display& d : o.displays)
        displays.push_back({{"file", d.file}, {"driver", d.driver}, {"mode", d.mode}});
    j["displays"] = displays;
    return j.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string to_text(const Summary& s) {
    std::string t;
    const auto line = [&](const std::string& label, const std::string& text) {
        t += label + std::string(label.size() < 14 ? 14 - label.size() : 1, ' ') + text + "\n";
    };
    const auto count = [](size_t n) { return std::to_string(n); };
    line("scene", s.file);
    line("primitives", count(s.primitives + s.group_primitives) + " (" + counts_text(s.by_kind) + ")");
    line("geometry", count(s.control_points) + " control points, " + count(s.faces) + " faces, " +
                         count(s.curves) + " curves, " + number(double(s.value_bytes) / 1e6) + " MB");
    if (s.groups > 0)
        line("instances", count(s.instances) + " of " + count(s.groups) + " groups (" +
                              count(s.group_primitives) + " primitives), standing for " +
                              count(s.instanced_primitives) + " primitives");
    if (!s.bounds.empty())
        line("bounds", number(s.bounds.lo.x) + " " + number(s.bounds.lo.y) + " " + number(s.bounds.lo.z) +
                           " to " + number(s.bounds.hi.x) + " " + number(s.bounds.hi.y) + " " +
                           number(s.bounds.hi.z));
    line("surfaces", counts_text(s.surfaces));
    if (!s.displacements.empty())
        line("displacements", counts_text(s.displacements));
    if (!s.interiors.empty())
        line("interiors", counts_text(s.interiors));
    line("lights",
         counts_text(s.light_shaders) + (s.lights ? ", " + count(s.lights) + " analytic" : "") +
             (s.area_light_primitives ? ", " + count(s.area_light_primitives) + " emitting primitives" : ""));
    const Options& o = s.options;
    const ProjectionKind& kind = kind_of(s.camera.projection);
    line("camera", std::string(kind.name) +
                       (kind.largest_fov > 0 ? ", " + number(s.camera.fov) + " degrees" : "") +
                       (s.camera.motion.size() > 1 ? ", moving" : ""));
    if (o.shutter_close > o.shutter_open)
        line("shutter", number(o.shutter_open) + " to " + number(o.shutter_close) + " (" +
                            count(s.moving_primitives + s.moving_instances) + " moving)");
    line("picture", count(size_t(o.width)) + " x " + count(size_t(o.height)) + ", " +
                        count(size_t(o.samples)) + " samples, " + o.filter + " filter " +
                        number(o.filter_width[0]) + " x " + number(o.filter_width[1]));
    line("integrator", o.integrator + ", depth " + std::to_string(o.max_depth));
    for (const Display& d : o.displays)
        line("display", d.file + " (" + d.driver + ", " + d.mode + ")");
    for (const std::string& p : o.shader_path)
        line("shader path", p);
    return t;
}

} // namespace kanuka::scene
