#include "python/surfaces.h"

#include <nanobind/ndarray.h>

#include "base/cancel.h"
#include "base/tasks.h"
#include "geom/decimate.h"
#include "python/arrays.h"
#include "python/render_request.h"
#include "python/supervisor.h"
#include "render/surfaces.h"

namespace kanuka::python {

namespace {

// ---- arrays -----------------------------------------------------------------------------------------------

// An array that takes over a vector; `columns` values a row.
template <class T, class V>
nb::object rows(std::vector<V>&& values, size_t columns) {
    auto kept = std::make_unique<std::vector<V>>(std::move(values));
    const size_t shape[] = {kept->size() * sizeof(V) / sizeof(T) / columns, columns};
    T* data = reinterpret_cast<T*>(kept->data());
    const nb::capsule owner(kept.release(), [](void* p) noexcept { delete static_cast<std::vector<V>*>(p); });
    return nb::ndarray<nb::numpy, T>(data, 2, shape, owner).cast();
}

void put_mesh(nb::dict& to, geom::ColoredMesh&& mesh) {
    to["points"] = rows<float>(std::move(mesh.points), 3);
    to["colors"] = rows<float>(std::move(mesh.colors), 3);
    to["triangles"] = rows<uint32_t>(std::move(mesh.triangles), 3);
}

nb::object matrices(std::vector<float>&& values) {
    return rows<float>(std::move(values), 12).attr("reshape")(-1, 3, 4);
}

// ---- what scenes became -----------------------------------------------------------------------------------

nb::list traced_surfaces(std::shared_ptr<Scene> scene, const nb::kwargs& keywords) {
    check_idle(*scene);
    RenderRequest request;
    take_keywords(request, render_keywords(), "traced_surfaces", keywords);
    request.complete(*scene);
    const Messages messages(request.journal);
    std::vector<render::SurfaceGroup> groups;
    Stats stats;
    Supervisor supervisor(request.progress);
    {
        const Reading reading(*scene);
        supervisor.run(
            [&] {
                groups = render::read_surfaces(scene->scene, request.overrides, *messages.journal, stats,
                                               supervisor.progress());
            },
            messages);
    }
    supervisor.rethrow_interrupt();
    nb::list list;
    for (render::SurfaceGroup& group : groups) {
        nb::dict entry;
        entry["name"] = group.name;
        entry["origin"] = nb::make_tuple(group.origin[0], group.origin[1], group.origin[2]);
        nb::list surfaces, instances;
        for (render::Surface& surface : group.surfaces) {
            nb::dict each;
            each["name"] = surface.name;
            each["kind"] = surface.kind;
            each["id"] = surface.id;
            each["micropolygons"] = surface.micropolygons;
            put_mesh(each, std::move(surface.mesh));
            surfaces.append(each);
        }
        for (auto& [child, places] : group.instances)
            instances.append(nb::make_tuple(child, matrices(std::move(places))));
        entry["surfaces"] = surfaces;
        entry["instances"] = instances;
        list.append(entry);
    }
    return list;
}

// ---- fewer triangles --------------------------------------------------------------------------------------

struct Decimated {
    geom::ColoredMesh mesh;
    uint64_t copies = 1;
    float scale = 1, weight = 1, color = 0;
    geom::Decimation steps;
};

[[noreturn]] void wrong(const std::string& text) {
    throw nb::value_error(("decimate: " + text).c_str());
}

Decimated decimated(nb::handle given) {
    if (!nb::isinstance<nb::dict>(given))
        wrong_argument("meshes", "dicts as traced_surfaces() gives them", given);
    const nb::dict mesh = nb::borrow<nb::dict>(given);
    for (const char* name : {"points", "colors", "triangles"})
        if (!mesh.contains(name))
            wrong(std::string("a mesh has no \"") + name + "\"");
    const FloatArray points = float_rows(mesh["points"], 3, "points"),
                     colors = float_rows(mesh["colors"], 3, "colors");
    const IntArray triangles = int_array(mesh["triangles"], "triangles");
    if (triangles.shape.size() != 2 || triangles.shape[1] != 3)
        wrong("triangles: expected shape (N, 3), got " + shape_text(triangles.shape));
    if (colors.shape != points.shape)
        wrong("colors: expected one for each point, " + shape_text(points.shape) + ", got " +
              shape_text(colors.shape));
    Decimated result;
    const auto vectors = [](const FloatArray& from, std::vector<Vec3f>& to) {
        for (size_t i = 0; i + 2 < from.buffer.size(); i += 3)
            to.push_back({from.buffer.data()[i], from.buffer.data()[i + 1], from.buffer.data()[i + 2]});
    };
    vectors(points, result.mesh.points), vectors(colors, result.mesh.colors);
    for (const Vec3f& p : result.mesh.points)
        if (!std::isfinite(p.x + p.y + p.z))
            wrong("points: one is not a number");
    for (size_t i = 0; i < triangles.buffer.size(); i++) {
        const int32_t v = triangles.buffer.data()[i];
        if (v < 0 || size_t(v) >= result.mesh.points.size())
            wrong("triangles: there is no point " + std::to_string(v));
        result.mesh.triangles.push_back(uint32_t(v));
    }
    if (mesh.contains("copies"))
        result.copies = argument<uint64_t>(mesh["copies"], "copies");
    if (mesh.contains("scale"))
        result.scale = argument<float>(mesh["scale"], "scale");
    if (mesh.contains("weight"))
        result.weight = argument<float>(mesh["weight"], "weight");
    if (mesh.contains("color_length"))
        result.color = argument<float>(mesh["color_length"], "color_length");
    if (!(result.color >= 0) || !std::isfinite(result.color))
        wrong("color_length must be 0 or more");
    if (!(result.weight >= 0) || !std::isfinite(result.weight))
        wrong("weight must be 0 or more");
    if (!(result.scale > 0) || !std::isfinite(result.scale))
        wrong("scale must be above 0");
    return result;
}

void decimate_all(std::vector<Decimated>& all, std::optional<float> error, const Progress& progress) {
    std::mutex mutex;
    size_t done = 0;
    tasks::parallel_for(all.size(), [&](size_t i) {
        Decimated& each = all[i];
        geom::DecimationLimits limits{.color = each.color, .cancelled = progress.cancelled};
        if (error)
            limits.error = *error / each.scale;
        each.steps = geom::Decimation(each.mesh, limits);
        const std::lock_guard lock(mutex);
        progress.update("decimate", double(++done) / double(all.size()));
    });
}

nb::list decimate(nb::list meshes, std::optional<uint64_t> faces, std::optional<float> error,
                  nb::handle progress) {
    if (!progress.is_none() && !PyCallable_Check(progress.ptr()))
        wrong_argument("progress", "a callable or None", progress);
    if (error && !(*error > 0))
        wrong("error must be above 0");
    std::vector<Decimated> all;
    for (const nb::handle mesh : meshes)
        all.push_back(decimated(mesh));
    std::vector<float> reached(all.size());
    Supervisor supervisor(progress);
    supervisor.run([&] {
        const Progress told = supervisor.progress();
        if (faces || error)
            decimate_all(all, error, told);
        std::vector<geom::DecimationShare> shares;
        for (const Decimated& each : all)
            shares.push_back({&each.steps, each.mesh.triangles.size() / 3, each.copies, each.weight});
        std::vector<size_t> steps;
        for (const Decimated& each : all)
            steps.push_back(each.steps.steps().size());
        if (faces)
            steps = geom::share_faces(shares, *faces);
        tasks::parallel_for(all.size(), [&](size_t i) {
            Decimated& each = all[i];
            if (steps[i] > 0)
                reached[i] = each.steps.steps()[steps[i] - 1].error * each.scale;
            each.mesh = each.steps.after(each.mesh, steps[i]);
            each.steps = {};
        });
    });
    supervisor.rethrow_interrupt();
    nb::list list;
    for (size_t i = 0; i < all.size(); i++) {
        nb::dict entry;
        put_mesh(entry, std::move(all[i].mesh));
        entry["error"] = reached[i];
        list.append(entry);
    }
    return list;
}

} // namespace

void bind_surfaces(nb::module_& m) {
    static const std::string sig = "def traced_surfaces(scene: Scene, *" +
                                   keyword_signature(render_keywords()) +
                                   ") -> list[dict[str, object]]"; // nanobind keeps the pointers
    define(
        m, "traced_surfaces", &traced_surfaces, nb::arg("scene"), nb::arg("keywords"), nb::sig(sig.c_str()),
        "What the primitives of a scene are diced and displaced to, as triangles with the albedo of their "
        "materials. Takes the\narguments of render(). Returns a dict for each group of instances, the world "
        "last: 'name', 'origin' (added to its\npoints), 'instances' as tuples of a group's number and (N, 3, "
        "4) "
        "matrices, 'surfaces' as dicts of 'name', 'kind', 'id',\n'micropolygons', 'points' (N, 3), 'colors' "
        "(N, "
        "3) in linear Rec.709 and 'triangles' (N, 3), whose outside is where they wind\nagainst the clock. "
        "kanuka.proxies writes files of them.");
    define(
        m, "decimate", &decimate, nb::arg("meshes"), nb::kw_only(), nb::arg("faces") = nb::none(),
        nb::arg("error") = nb::none(), nb::arg("progress") = nb::none(),
        nb::sig("def decimate(meshes: list, *, faces: int | None = None, error: float | None = "
                "None, progress: Callable[[str, float], object] | None = None) -> list[dict[str, object]]"),
        "Fewer triangles for meshes of 'points', 'colors' and 'triangles', as traced_surfaces() has them. "
        "faces: "
        "that all of them\nhave at most, where a mesh counts 'copies' times (1) and its squared errors, over "
        "its "
        "area, count 'weight' times (1);\na step from black to white counts as the distance 'color_length' "
        "(a fiftieth of the mesh). error: how\nfar a point of a mesh may be from what is left of it, "
        "where "
        "lengths are multiplied by its 'scale' (1); colours are off by a\ntenth in the root mean square, of "
        "their "
        "square roots. Returns what is left, with 'error', the largest distance. Closed surfaces\nstay "
        "closed.");
}

} // namespace kanuka::python
