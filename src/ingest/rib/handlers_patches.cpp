// Patch, PatchMesh, NuPatch, and the Basis that they use.

#include "ingest/rib/context.h"
#include "ingest/rib/handlers.h"

namespace kanuka::ingest::handlers {

using namespace scene;

static bool patch_type(Context& c, const Call& call, bool& cubic) {
    const std::string& type = call.text(0);
    cubic = type == "bicubic";
    if (cubic || type == "bilinear")
        return true;
    c.reports.error("type of patch", call.where,
                    std::string(call.spec->name) + " \"" + type +
                        "\" was left out: the type must be bilinear or bicubic");
    return false;
}

void patch(Context& c, Call& call) {
    PatchMesh mesh;
    if (!patch_type(c, call, mesh.cubic))
        return;
    mesh.nu = mesh.nv = mesh.cubic ? 4 : 2;
    mesh.u_basis = c.attributes.u_basis;
    mesh.v_basis = c.attributes.v_basis;
    c.add_primitive(call, std::move(mesh));
}

void patch_mesh(Context& c, Call& call) {
    PatchMesh mesh;
    if (!patch_type(c, call, mesh.cubic))
        return;
    for (const size_t i : {size_t(2), size_t(4)})
        if (call.text(i) != "periodic" && call.text(i) != "nonperiodic") {
            c.reports.error("wrap of PatchMesh", call.where,
                            "PatchMesh: the wrap \"" + call.text(i) +
                                "\" must be periodic or nonperiodic; the primitive was left out");
            return;
        }
    mesh.nu = call.i(1);
    mesh.nv = call.i(3);
    mesh.u_periodic = call.text(2) == "periodic";
    mesh.v_periodic = call.text(4) == "periodic";
    mesh.u_basis = c.attributes.u_basis;
    mesh.v_basis = c.attributes.v_basis;
    c.add_primitive(call, std::move(mesh));
}

void nu_patch(Context& c, Call& call) {
    NuPatch n{};
    n.nu = call.i(0);
    n.u_order = call.i(1);
    n.u_knots = std::vector<float>(call.args[2].floats);
    n.u_min = call.f(3);
    n.u_max = call.f(4);
    n.nv = call.i(5);
    n.v_order = call.i(6);
    n.v_knots = std::vector<float>(call.args[7].floats);
    n.v_min = call.f(8);
    n.v_max = call.f(9);
    if (c.attributes.trimmed)
        c.reports.once(Severity::Warning, "TrimCurve", call.where,
                       "NuPatch with TrimCurve is rendered whole: trimming is not supported yet");
    c.add_primitive(call, std::move(n));
}

void trim_curve(Context& c, Call& call) {
    // TrimCurve without curves ends trimming.
    c.attributes.trimmed = !call.args[0].ints.empty();
}

static bool basis_of(Context& c, const Call& call, size_t i, Basis& basis) {
    const Argument& a = call.args[i];
    if (a.is_text) {
        try {
            basis = basis_by_name(a.text);
        } catch (const Error& e) {
            c.reports.error("Basis", call.where,
                            std::string("Basis: ") + e.what() + "; the basis stays as it was");
            return false;
        }
    } else {
        for (size_t row = 0; row < 4; row++)
            for (size_t column = 0; column < 4; column++)
                basis.m[row][column] = a.floats[row * 4 + column];
    }
    basis.step = call.i(i + 1);
    if (basis.step >= 1)
        return true;
    c.reports.error("Basis", call.where,
                    "Basis: a step of " + std::to_string(basis.step) +
                        " must be 1 or more; the basis stays as it was");
    return false;
}

void basis(Context& c, Call& call) {
    Basis u, v;
    if (!c.finite(call, 4) || !basis_of(c, call, 0, u) || !basis_of(c, call, 2, v))
        return;
    c.attributes.u_basis = u;
    c.attributes.v_basis = v;
}

} // namespace kanuka::ingest::handlers
