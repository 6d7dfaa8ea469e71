// Patch, PatchMesh, NuPatch, and the Basis that they use.

#include <algorithm>

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

// RISpec says nonperiodic; some published files say nowrap.
static bool is_open(std::string_view wrap) {
    return wrap == "nonperiodic" || wrap == "nowrap";
}

void patch_mesh(Context& c, Call& call) {
    PatchMesh mesh;
    if (!patch_type(c, call, mesh.cubic))
        return;
    for (const size_t i : {size_t(2), size_t(4)})
        if (call.text(i) != "periodic" && !is_open(call.text(i))) {
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
    if (c.attributes.trim) {
        n.trim = c.attributes.trim;
        const std::string sense = c.attributes.shared->user.get_string("trimcurve:sense", "inside");
        if (sense == "outside") {
            auto turned = std::make_shared<TrimCurves>(*n.trim);
            turned->outside = true;
            n.trim = std::move(turned);
        } else if (sense != "inside") {
            c.reports.error("trimcurve", call.where,
                            "Attribute \"trimcurve\" \"sense\" \"" + sense +
                                "\" must be inside or outside; inside was used");
        }
    }
    c.add_primitive(call, std::move(n));
}

// TrimCurve without curves ends trimming.
void trim_curve(Context& c, Call& call) {
    c.attributes.trim = nullptr;
    if (call.args[0].ints.empty())
        return;
    TrimCurves t;
    const auto ints = [&](size_t i) { return Buffer<int32_t>(std::vector<int32_t>(call.args[i].ints)); };
    const auto floats = [&](size_t i) { return Buffer<float>(std::vector<float>(call.args[i].floats)); };
    t.curves_per_loop = ints(0);
    t.order = ints(1);
    t.knots = floats(2);
    t.min = floats(3);
    t.max = floats(4);
    t.points = ints(5);
    t.u = floats(6);
    t.v = floats(7);
    t.w = floats(8);
    t.where = call.where;
    int64_t curves = 0, knots = 0, points = 0;
    for (const int32_t n : t.curves_per_loop)
        curves += std::max(n, 0);
    for (size_t i = 0; i < std::min(t.order.size(), t.points.size()); i++) {
        knots += int64_t(std::max(t.order[i], 0)) + std::max(t.points[i], 0);
        points += std::max(t.points[i], 0);
    }
    const auto expect = [&](const char* name, size_t found, int64_t expected) {
        if (int64_t(found) == expected)
            return true;
        c.reports.error("TrimCurve", call.where,
                        std::string("TrimCurve was left out: ") + name + ": expected " +
                            std::to_string(expected) + " values, found " + std::to_string(found));
        return false;
    };
    if (expect("order", t.order.size(), curves) && expect("n", t.points.size(), curves) &&
        expect("min", t.min.size(), curves) && expect("max", t.max.size(), curves) &&
        expect("knot", t.knots.size(), knots) && expect("u", t.u.size(), points) &&
        expect("v", t.v.size(), points) && expect("w", t.w.size(), points))
        c.attributes.trim = std::make_shared<TrimCurves>(std::move(t));
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
