#include "python/procedurals.h"

#include <cmath>
#include <filesystem>
#include <map>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/vector.h>

#include "dice/dice.h"
#include "ingest/rib/search_path.h"
#include "python/archives.h"
#include "python/arguments.h"
#include "python/values.h"

namespace kanuka::python {

using ingest::ProceduralRequest;

// ---- plug-ins ---------------------------------------------------------------------------------------

namespace {

std::string name_of(const ProceduralRequest& r) {
    return r.type == "DynamicLoad" && !r.arguments.empty() ? r.arguments[0] : r.type;
}
std::string data_of(const ProceduralRequest& r) {
    return r.arguments.size() > 1 ? r.arguments[1] : "";
}

// What a plug-in gives: text, or bytes, which may hold RIB's binary encodings.
std::string rib_of(nb::handle answer) {
    if (nb::isinstance<nb::bytes>(answer)) {
        const nb::bytes bytes = nb::cast<nb::bytes>(answer);
        return {bytes.c_str(), bytes.size()};
    }
    try {
        return nb::cast<std::string>(answer);
    } catch (const nb::cast_error&) {
        throw Error("the plug-in did not return a str or bytes of RIB");
    }
}

} // namespace

std::function<std::optional<std::string>(const ProceduralRequest&)> plug_ins(nb::dict procedurals) {
    const bool any = procedurals.size() > 0;
    // Copies are made and dropped on threads that do not hold the interpreter.
    const std::shared_ptr<nb::dict> shared(new nb::dict(std::move(procedurals)), [](nb::dict* dict) {
        const nb::gil_scoped_acquire gil;
        delete dict;
    });
    return [shared, any](const ProceduralRequest& request) -> std::optional<std::string> {
        if (!any && (request.type == "DelayedReadArchive" || request.type == "RunProgram"))
            return std::nullopt; // a million of them need no interpreter
        const nb::gil_scoped_acquire gil;
        const std::string given = name_of(request);
        try {
            for (const std::string& name : {given, std::filesystem::path(given).stem().string()})
                if (shared->contains(name.c_str())) {
                    const nb::object function = (*shared)[name.c_str()];
                    if (nb::hasattr(function, "takes_request"))
                        return rib_of(function(nb::cast(request)));
                    request.uses_detail->store(true);
                    return rib_of(function(request.detail, data_of(request)));
                }
            const nb::object answer =
                nb::module_::import_("kanuka.procedurals").attr("expand")(nb::cast(request));
            if (answer.is_none())
                return std::nullopt;
            return rib_of(answer);
        } catch (nb::python_error& e) {
            // The last line says what is wrong; what is above it is for whoever writes plug-ins.
            std::string what = nb::cast<std::string>(nb::str(e.value()));
            const std::string type = nb::cast<std::string>(e.type().attr("__name__"));
            throw Error(type + ": " + what);
        }
    };
}

// ---- surfaces that plug-ins grow things on ----------------------------------------------------------

namespace {

// Triangles of all surfaces of an archive, with what there is at their vertices.
struct SurfaceMesh {
    std::vector<float> P, N, st;
    std::vector<int32_t> triangles;
    struct Channel {
        int components;
        std::vector<float> data;
    };
    std::map<std::string, Channel> primvars;
    size_t vertices() const { return P.size() / 3; }

    void add_vertices(const grid::Grid& g) {
        const size_t first = vertices(), count = size_t(g.vertices());
        const auto three = [&](const std::vector<float>& from, std::vector<float>& to) {
            for (size_t i = 0; i < count; i++)
                for (size_t c = 0; c < 3; c++)
                    to.push_back(from.empty() ? 0 : from[c * size_t(g.stride) + i]);
        };
        three(g.P, P);
        three(g.N, N);
        for (size_t i = 0; i < count; i++) {
            st.push_back(g.s.empty() ? 0 : g.s[i]);
            st.push_back(g.t.empty() ? 0 : g.t[i]);
        }
        for (const grid::Channel& c : g.primvars) {
            Channel& to = primvars.try_emplace(c.name, Channel{c.components, {}}).first->second;
            if (to.components != c.components)
                continue;
            to.data.resize(first * size_t(c.components));
            for (size_t i = 0; i < count; i++)
                for (int k = 0; k < c.components; k++)
                    to.data.push_back(c.data[size_t(k) * size_t(c.stride) + i]);
        }
        for (auto& [name, to] : primvars)
            to.data.resize(vertices() * size_t(to.components));
    }
    void triangle(uint32_t a, uint32_t b, uint32_t c) {
        if (a != b && b != c && c != a)
            triangles.insert(triangles.end(), {int32_t(a), int32_t(b), int32_t(c)});
    }
    void add(const dice::Diced& diced) {
        if (diced.is_mesh) {
            const uint32_t first = uint32_t(vertices());
            add_vertices(diced.mesh_vertices);
            const auto& m = diced.mesh;
            const size_t n = size_t(m.vertices_per_face);
            for (size_t f = 0; f + n <= m.indices.size(); f += n) {
                const uint32_t* v = &m.indices[f];
                if (n == 3) {
                    triangle(first + v[0], first + v[1], first + v[2]);
                } else { // as grid::TracedMesh has it
                    triangle(first + v[0], first + v[1], first + v[3]);
                    triangle(first + v[2], first + v[3], first + v[1]);
                }
            }
            return;
        }
        for (const grid::Grid& g : diced.grids) {
            const uint32_t first = uint32_t(vertices()), row = uint32_t(g.nu + 1);
            add_vertices(g);
            for (uint32_t j = 0; j < uint32_t(g.nv); j++)
                for (uint32_t i = 0; i < uint32_t(g.nu); i++) {
                    const uint32_t a = first + j * row + i;
                    triangle(a, a + 1, a + row);
                    triangle(a + row + 1, a + row, a + 1);
                }
        }
    }
};

// Mesh normals may be left to the tracer's faces: where there are none they are made here.
void mend_normals(SurfaceMesh& m) {
    std::vector<float> sums(m.P.size());
    for (size_t f = 0; f + 3 <= m.triangles.size(); f += 3) {
        const auto at = [&](size_t k) {
            const float* p = &m.P[3 * size_t(m.triangles[f + k])];
            return Vec3f(p[0], p[1], p[2]);
        };
        const Vec3f n = cross(at(1) - at(0), at(2) - at(0));
        for (size_t k = 0; k < 3; k++)
            for (size_t c = 0; c < 3; c++)
                sums[3 * size_t(m.triangles[f + k]) + c] += n[int(c)];
    }
    for (size_t v = 0; v < m.vertices(); v++) {
        float* n = &m.N[3 * v];
        if (!(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0))
            std::copy_n(&sums[3 * v], 3, n);
        const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int c = 0; c < 3; c++)
            n[c] = length > 0 ? n[c] / length : float(c == 2);
    }
}

SurfaceMesh surface_mesh(const std::string& path, float edge) {
    Journal journal;
    const scene::Scene scene = read_archive(path, {}, journal);
    for (const Journal::Entry& e : journal.entries())
        if (e.severity == Severity::Error)
            throw Error(e.where, e.message);
    const auto dice_all = [&](float per_unit) {
        SurfaceMesh mesh;
        dice::DiceOptions options;
        options.geometry_tolerance = 0;
        for (const scene::Primitive& p : scene.primitives) {
            if (std::holds_alternative<scene::Curves>(p.geometry) ||
                std::holds_alternative<scene::Points>(p.geometry))
                continue;
            dice::DiceTarget target;
            target.page_from_object = p.world_from_object;
            target.pixels_per_unit = per_unit;
            mesh.add(dice::dice(p, target, options, {}, journal));
        }
        return mesh;
    };
    if (!(edge > 0)) { // a two-hundredth of its size
        const SurfaceMesh coarse = dice_all(1e-3f);
        Bounds3f b;
        for (size_t v = 0; v < coarse.vertices(); v++)
            b.extend(Vec3f(coarse.P[3 * v], coarse.P[3 * v + 1], coarse.P[3 * v + 2]));
        edge = b.empty() ? 1 : std::max(length(b.hi - b.lo) / 200, 1e-20f);
    }
    SurfaceMesh mesh = dice_all(1 / edge);
    if (mesh.triangles.empty())
        throw Error(Location{path}, "the archive has no surfaces to grow anything on");
    mend_normals(mesh);
    return mesh;
}

nb::dict as_dict(const SurfaceMesh& m) {
    nb::dict out;
    const size_t n = m.vertices();
    out["P"] = array_of(m.P.data(), {n, 3});
    out["N"] = array_of(m.N.data(), {n, 3});
    out["st"] = array_of(m.st.data(), {n, 2});
    out["triangles"] = array_of(m.triangles.data(), {m.triangles.size() / 3, 3});
    nb::dict primvars;
    for (const auto& [name, c] : m.primvars)
        primvars[name.c_str()] = array_of(c.data.data(), {n, size_t(c.components)});
    out["primvars"] = primvars;
    return out;
}

} // namespace

void bind_procedurals(nb::module_& m) {
    nb::class_<ProceduralRequest>(m, "ProceduralRequest", "What a scene asks of a procedural plug-in.")
        .def_prop_ro(
            "type", [](const ProceduralRequest& r) { return r.type; }, "DynamicLoad, …")
        .def_prop_ro("name", name_of, "of the plug-in")
        .def_prop_ro("data", data_of, "the text that the scene gives")
        .def_prop_ro(
            "detail",
            [](const ProceduralRequest& r) {
                r.uses_detail->store(true);
                return r.detail;
            },
            "pixels that the bound covers; 1e38 where that has no end")
        .def_prop_ro(
            "bound", [](const ProceduralRequest& r) { return r.bound; },
            "xmin xmax ymin ymax zmin zmax; empty = none")
        .def_prop_ro(
            "folders", [](const ProceduralRequest& r) { return r.folders; }, "searched for files")
        .def_prop_ro(
            "where", [](const ProceduralRequest& r) { return r.where.str(); }, "file:line:column")
        .def_prop_ro(
            "declared", [](const ProceduralRequest& r) { return r.declared; },
            "the scene's declarations: name, text, name, text, …")
        .def_prop_ro(
            "in_object", [](const ProceduralRequest& r) { return r.in_object; },
            "between ObjectBegin and ObjectEnd: it may not open one of its own")
        .def_prop_ro(
            "may_run", [](const ProceduralRequest& r) { return r.may_run; },
            "code from outside of the package may run")
        .def_prop_ro(
            "parameters",
            [](const ProceduralRequest& r) {
                nb::dict out;
                for (const scene::Value& v : r.parameters.values)
                    out[v.name.c_str()] = value_of(v);
                return out;
            },
            "of Procedural2, by name")
        .def(
            "find",
            [](const ProceduralRequest& r, const std::string& file) {
                return ingest::find_file(file, r.folders);
            },
            nb::arg("file"), "Path of a file that the scene names; None = it is not in the folders.");
    define(
        m, "surface_mesh",
        [](const std::filesystem::path& path, float edge) {
            SurfaceMesh mesh;
            {
                const nb::gil_scoped_release release;
                mesh = surface_mesh(path.string(), edge);
            }
            return as_dict(mesh);
        },
        nb::arg("path"), nb::arg("edge") = 0.0f,
        "Triangles of all surfaces in an archive (limit surfaces, diced): P, N, st, triangles, primvars.\n"
        "`edge` is about the length of their edges; 0 = a two-hundredth of the archive's size.");
}

} // namespace kanuka::python
