// What every add_* of a scene or group takes beside its geometry, and how a primitive is added.
#pragma once

#include "python/keywords.h"
#include "python/values.h"

namespace kanuka::python {

struct Looks {
    nb::handle material = nb::none(), transform = nb::none(), area_light = nb::none();
    nb::handle times = nb::none(); // of what moves
    nb::handle solid = nb::none(); // a Solid that it bounds
    std::string name;
    float shading_rate = 1;
    int variants = 1;
    bool visible_camera = true, double_sided = true, reverse_orientation = false;
    std::vector<std::string> lights_off, shadows_off;
};
Looks looks_of(const char* call, const nb::kwargs& given);
// ", material: … = None, …": the end of a signature.
std::string looks_signature();

// Where primitives go: a scene, or a group of it.
struct Place {
    Scene& scene;
    const Group* group; // null = the world
    // Arguments run code of their own as they are read, which may move groups and begin to render: this is
    // for what comes after, and before it to say early what cannot be.
    scene::Group* now() const;
};
Place place(Scene& s);
Place place(Group& g);

// Returns its number, as in the picture's "id" layer.
int add(Place place, scene::Primitive primitive, const Looks& looks);

// A node of a tree of set operations, in the world or a group; made by add_solid().
struct Solid {
    std::shared_ptr<Scene> owner;
    scene::NodeId group, id; // None = the world
};

// ---- arrays of geometry

// An array with one slice for each time, (T, …), as T arrays; otherwise one.
nb::list slices(nb::handle array, size_t dimensions);
// P of one time, (N, 3); Pw of (N, 4), homogeneous, where that will do.
scene::Value positions(nb::handle points, bool homogeneous = false);
// The primitive in every shape that `points` (and `normals`, which may be None) gives for a time.
void add_shapes(scene::Primitive& primitive, nb::list points, nb::handle normals,
                std::span<const DetailCount> counts, nb::handle times);

// The arguments of shapes whose points say how many values their primvars have.
struct PointPrimvars {
    nb::list points; // at every time
    bool homogeneous = false;
    nb::handle widths = nb::none(), normals = nb::none(), uv = nb::none();
    nb::dict primvars;
};
int add(Place place, scene::Geometry geometry, const PointPrimvars& given, const Looks& looks);
// All of them but the points of the first time, which the primitive has.
void add_primvars(scene::Primitive& primitive, const PointPrimvars& given,
                  std::span<const DetailCount> counts, nb::handle times);

} // namespace kanuka::python
