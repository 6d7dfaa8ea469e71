#include "geom/primvars.h"

namespace kanuka::geom {

using scene::Detail;
using scene::Type;

float* Primvar::destination(grid::Grid& grid, int c) const {
    switch (target) {
    case Target::S:
        return grid.s.data();
    case Target::T:
        return grid.t.data();
    case Target::ST:
        return c == 0 ? grid.s.data() : grid.t.data();
    case Target::Normal:
        return grid.N.data() + size_t(c) * grid.stride;
    case Target::Channel:
        break;
    }
    return grid.primvars[channel].component(c);
}

void Primvars::allocate_channels(grid::Grid& grid) const {
    for (const Primvar& p : list)
        if (p.target == Primvar::Target::Channel) {
            grid::Channel& c = grid.primvars.emplace_back();
            c.name = p.name;
            c.components = p.components;
            c.stride = grid.stride;
            c.data.assign(size_t(c.stride) * p.components, 0.0f);
        }
}

const Primvar* Primvars::find(std::string_view name) const {
    for (const Primvar& p : list)
        if (p.name == name)
            return &p;
    return nullptr;
}

void Primvars::keep_normals() {
    std::erase_if(list, [](const Primvar& p) { return p.target != Primvar::Target::Normal; });
    s = t = false;
}

static size_t needed(Detail detail, const ItemCounts& counts) {
    switch (detail) {
    case Detail::Constant:
        return 1;
    case Detail::Uniform:
        return counts.uniform;
    case Detail::Varying:
        return counts.varying;
    case Detail::Vertex:
        return counts.vertex;
    case Detail::FaceVarying:
    case Detail::FaceVertex:
        return counts.facevarying;
    }
    return 0;
}

// Geometric types live in object space and are handed to shaders in the page's space.
static scene::Buffer<float> transformed(const scene::Buffer<float>& in, Type type, const Transform& m) {
    if (type == Type::HPoint) { // who reads it divides by w, after interpolation
        std::vector<float> out(in.size());
        for (size_t i = 0; i + 3 < in.size(); i += 4)
            for (size_t r = 0; r < 4; r++) {
                double sum = 0;
                for (size_t c = 0; c < 4; c++)
                    sum += m.m[r][c] * double(in[i + c]);
                out[i + r] = float(sum);
            }
        return out;
    }
    if (type != Type::Point && type != Type::Vector && type != Type::Normal)
        return in;
    Transform inverse;
    if (type == Type::Normal && m.determinant3() != 0)
        inverse = m.inverse();
    std::vector<float> out(in.size());
    for (size_t i = 0; i + 2 < in.size(); i += 3) {
        const Vec3f v{in[i], in[i + 1], in[i + 2]};
        const Vec3f r = type == Type::Point    ? m.point(v)
                        : type == Type::Vector ? m.vector(v)
                                               : m.normal(v, inverse);
        out[i] = r.x, out[i + 1] = r.y, out[i + 2] = r.z;
    }
    return out;
}

Primvars collect_primvars(const scene::Primitive& primitive, const Transform& page_from_object,
                          const ItemCounts& counts, Journal& journal) {
    Primvars out;
    int channels = 0;
    const bool has_n = primitive.primvars.find("N") != nullptr;
    for (const scene::Value& value : primitive.primvars.values) {
        const std::string& n = value.name;
        if (n == "P" || n == "Pw" || n == "Pz" || n == "width" || n == "constantwidth" ||
            value.type == Type::String || value.detail == Detail::Constant || (n == "Np" && has_n))
            continue;
        const size_t need = needed(value.detail, counts);
        if (value.items() < need || need == 0) {
            journal.warning(value.where.str().empty() ? primitive.where : value.where,
                            "primitive variable \"" + n + "\" of class " +
                                std::string(scene::name(value.detail)) + " has " +
                                std::to_string(value.items()) + " values where " + std::to_string(need) +
                                " are needed; it is left out. Check its declared class and length");
            continue;
        }
        Primvar p;
        p.name = n;
        p.detail = value.detail;
        p.components = scene::components(value.type) * value.array_size;
        const bool normal = n == "N" || n == "Np";
        if (value.type == Type::Integer)
            p.values = std::vector<float>(value.ints.begin(), value.ints.end());
        else
            p.values = transformed(value.floats, normal ? Type::Normal : value.type, page_from_object);
        if (normal && p.components == 3) {
            p.target = Primvar::Target::Normal;
            out.normals = true;
        } else if (n == "st" && p.components == 2) {
            p.target = Primvar::Target::ST;
            out.s = out.t = true;
        } else if (n == "s" && p.components == 1) {
            p.target = Primvar::Target::S;
            out.s = true;
        } else if (n == "t" && p.components == 1) {
            p.target = Primvar::Target::T;
            out.t = true;
        } else {
            p.channel = channels++;
        }
        out.list.push_back(std::move(p));
    }
    return out;
}

} // namespace kanuka::geom
