#include "ingest/rib/primvars.h"

#include <algorithm>

#include "ingest/rib/repair.h"
#include "ingest/rib/requests.h"
#include "scene/counts.h"

namespace kanuka::ingest {

using scene::Detail;
using scene::Type;
using scene::Value;

namespace {

size_t stored(const Value& v) {
    return v.type == Type::String    ? v.strings.size()
           : v.type == Type::Integer ? v.ints.size()
                                     : v.floats.size();
}

template <class T>
void cut(scene::Buffer<T>& buffer, size_t size) {
    if (buffer.size() > size)
        buffer = std::vector<T>(buffer.begin(), buffer.begin() + size);
}

// Heights over the unit square of parameters (RISpec 5.2): x = u, y = v of each control point.
bool expand_heights(scene::ValueList& params, const scene::Geometry& geometry) {
    Value* pz = nullptr;
    for (Value& v : params.values)
        if (v.name == "Pz")
            pz = &v;
    size_t nu = 0, nv = 0;
    if (const auto* m = std::get_if<scene::PatchMesh>(&geometry))
        nu = size_t(m->nu), nv = size_t(m->nv);
    else if (const auto* n = std::get_if<scene::NuPatch>(&geometry))
        nu = size_t(n->nu), nv = size_t(n->nv);
    if (!pz || nu < 2 || nv < 2 || pz->type != Type::Float || pz->floats.size() != nu * nv)
        return false;
    std::vector<float> p;
    p.reserve(nu * nv * 3);
    for (size_t j = 0; j < nv; j++)
        for (size_t i = 0; i < nu; i++)
            p.insert(p.end(), {float(i) / float(nu - 1), float(j) / float(nv - 1), pz->floats[j * nu + i]});
    pz->name = "P";
    pz->type = Type::Point;
    pz->detail = Detail::Vertex;
    pz->floats = std::move(p);
    return true;
}

// Which storage class `items` values would fit: the likely slip.
std::string would_fit(const scene::PrimvarCounts& counts, size_t items, Detail except) {
    for (const Detail d : {Detail::Uniform, Detail::Vertex, Detail::Varying, Detail::FaceVarying})
        if (d != except && counts.of(d) == items)
            return "; " + std::to_string(items) + " would fit \"" + std::string(name(d)) + "\"";
    return items == 1 && except != Detail::Constant ? "; 1 would fit \"constant\"" : "";
}

} // namespace

bool check_primvars(Call& call, scene::Geometry& geometry, Reports& reports) {
    const auto request = [&] { return std::string(call.spec->name); }; // for messages
    auto& values = call.params.values;
    const bool quadric = std::holds_alternative<scene::Quadric>(geometry) ||
                         std::holds_alternative<scene::Blobby>(geometry) ||
                         std::holds_alternative<scene::Volume>(geometry); // those without positions

    // Step 1: positions.
    if (!quadric && !call.params.find("P") && !call.params.find("Pw") &&
        !expand_heights(call.params, geometry)) {
        const bool heights = call.params.find("Pz") != nullptr;
        reports.error("no P", call.where,
                      request() +
                          (heights ? " cannot take its positions from \"Pz\"; give \"P\""
                                   : " has no positions; give \"P\"") +
                          ". The primitive was left out");
        return false;
    }
    size_t positions = 0;
    for (const std::string_view name : {"P", "Pw"})
        if (const Value* p = call.params.find(name)) {
            if (scene::components(p->type) != (p->name == "P" ? 3 : 4) || p->array_size != 1) {
                reports.error("type of P", p->where,
                              request() + ": \"" + std::string(name) + "\" must be of type " +
                                  (p->name == "P" ? "point" : "hpoint") + ". The primitive was left out");
                return false;
            }
            positions = p->items();
        }

    // Step 2: the shape.
    drop_bad_parts(call, geometry, positions, reports);
    if (const Value* p = call.params.find("P"); p && std::holds_alternative<scene::Curves>(geometry))
        positions = p->items(); // those of dropped curves are gone
    if (const auto fault = scene::fault_of(geometry, positions)) {
        reports.error("shape of " + request(), call.where, request() + " was left out: " + *fault);
        return false;
    }

    // Step 3: every variable has as many values as its class asks for.
    const scene::PrimvarCounts counts = scene::primvar_counts(geometry, positions);
    for (size_t i = 0; i < values.size();) {
        Value& v = values[i];
        const bool is_position = v.name == "P" || v.name == "Pw";
        if (is_position && !quadric)
            v.detail = Detail::Vertex;
        const size_t element = size_t(components(v.type)) * size_t(v.array_size);
        const size_t needed = counts.of(v.detail) * element;
        const size_t found = stored(v);
        if (found < needed || (quadric && is_position)) {
            const std::string what =
                request() + ": \"" + v.name + "\": expected " + std::to_string(needed) +
                (v.type == Type::String ? " strings (" : " numbers (") + std::to_string(counts.of(v.detail)) +
                " " + std::string(name(v.detail)) + " values), found " + std::to_string(found) +
                (found % element == 0 ? would_fit(counts, found / element, v.detail) : "");
            reports.error("too few values", v.where,
                          what +
                              (is_position ? ". The primitive was left out" : ". The variable was left out"));
            if (is_position)
                return false;
            values.erase(values.begin() + long(i));
            continue;
        }
        // Vertices that no face uses are common and harmless; other surplus is a slip.
        const bool unused_vertices =
            (v.detail == Detail::Vertex || v.detail == Detail::Varying) && found == positions * element;
        if (found > needed && !unused_vertices)
            reports.warning("too many values", v.where,
                            request() + ": \"" + v.name + "\": expected " + std::to_string(needed) +
                                " values, found " + std::to_string(found) + "; the last ones were not used" +
                                (found % element == 0 ? would_fit(counts, found / element, v.detail) : ""));
        cut(v.floats, needed);
        cut(v.ints, needed);
        cut(v.strings, needed);
        i++;
    }
    return true;
}

} // namespace kanuka::ingest
