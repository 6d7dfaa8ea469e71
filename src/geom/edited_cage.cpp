#include "geom/edited_cage.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opensubdiv/far/primvarRefiner.h>

namespace kanuka::geom {
namespace {

// Rows of floats as OpenSubdiv wants them: elements that can be cleared and added to.
struct Rows {
    struct Row {
        float* data;
        int width;
        void Clear() { std::fill_n(data, width, 0.0f); }
        void AddWithWeight(const Row& other, float w) {
            for (int i = 0; i < width; i++)
                data[i] = fma(w, other.data[i], data[i]);
        }
    };
    float* data;
    int width;
    Row operator[](int i) const { return {data + size_t(i) * size_t(width), width}; }
};

bool is_face_varying(const Primvar& p) {
    return p.detail == scene::Detail::FaceVarying || p.detail == scene::Detail::FaceVertex;
}

float changed(How how, float old, float value) {
    return how == How::Set ? value : how == How::Add ? old + value : old - value;
}

float sharpness_in_range(float s) {
    return std::clamp(s, 0.0f, 10.0f);
} // 10: infinitely sharp

// Values are in object space, data in the page's space; what is added to a point is a vector.
void transform(std::vector<float>& values, const Operation& o, const Transform& m, const Transform& inverse) {
    using scene::Type;
    if (o.type != Type::Point && o.type != Type::Vector && o.type != Type::Normal)
        return;
    for (size_t i = 0; i + 2 < values.size(); i += 3) {
        const Vec3f v{values[i], values[i + 1], values[i + 2]};
        const Vec3f r = o.type == Type::Normal                       ? m.normal(v, inverse)
                        : o.type == Type::Point && o.how == How::Set ? m.point(v)
                                                                     : m.vector(v);
        values[i] = r.x, values[i + 1] = r.y, values[i + 2] = r.z;
    }
}

} // namespace

void EditedCage::begin() {
    for (Primvar& p : m_primvars.list) {
        const size_t n = size_t(p.components);
        std::vector<float> own;
        if (p.detail == scene::Detail::Uniform) {
            for (const int f : m_cage.face)
                own.insert(own.end(), &p.values[f * n], &p.values[f * n] + n);
        } else if (is_face_varying(p)) {
            for (size_t f = 0; f < m_cage.sizes.size(); f++) {
                const float* first = p.values.data() + size_t(m_cage.corner[f]) * n;
                own.insert(own.end(), first, first + size_t(m_cage.sizes[f]) * n);
            }
        } else {
            continue;
        }
        p.values = std::move(own);
    }
    m_cage.corner.assign(m_cage.first.begin(), m_cage.first.end() - 1);
    m_cage.own_uniform = true;
    m_cage.ranges.resize(m_cage.sizes.size());
}

bool EditedCage::refine(std::vector<Edit>& edits, size_t level) {
    std::vector<FaceVaryingChannel> channels;
    for (const Primvar& p : m_primvars.list)
        if (is_face_varying(p))
            channels.push_back(join_face_varying(m_cage, p, m_points.size()));
    const auto refiner = make_refiner(m_cage, m_points.size(), channels);
    if (!refiner)
        return false;
    osd::Far::TopologyRefiner::UniformOptions options(1);
    options.fullTopologyInLastLevel = true;
    refiner->RefineUniform(options);
    const osd::Far::TopologyLevel &coarse = refiner->GetLevel(0), &fine = refiner->GetLevel(1);
    std::erase_if(edits, [&](Edit& e) {
        if (e.children.size() > level)
            e.face = coarse.GetFaceChildFaces(e.face)[e.children[level]];
        return e.face < 0;
    });
    refine_values(*refiner, fine, channels);
    refine_topology(coarse, fine);
    return true;
}

void EditedCage::apply(const Edit& e, const Transform& m, const Transform& inverse) {
    const int first = m_cage.first[e.face], n = m_cage.sizes[e.face];
    const int vertex = m_cage.vertices[first + e.corner];
    const float sharpness = e.values.empty() ? 0 : e.values[0];
    switch (e.operation.what) {
    case What::Hole:
        m_cage.holes.push_back(e.face);
        break;
    case What::Corner:
        set_corner(vertex, e.operation.how, sharpness);
        break;
    case What::Crease:
        set_crease(vertex, m_cage.vertices[first + (e.corner + 1) % n], e.operation.how, sharpness);
        break;
    case What::Value:
    case What::FaceValue: {
        std::vector<float> values = e.values;
        transform(values, e.operation, m, inverse);
        change_value(e, vertex, first + e.corner, values);
    }
    }
}

void EditedCage::end_level() {
    for (auto& [primvar, values] : m_written)
        m_primvars.list[primvar].values = std::move(values);
    m_written.clear();
    drop_smooth();
}

// Sharpness that came to nothing goes.
void EditedCage::drop_smooth() {
    Cage& c = m_cage;
    size_t to = 0;
    for (size_t i = 0; i < c.crease_weights.size(); i++)
        if (c.crease_weights[i] > 0) {
            c.crease_weights[to] = c.crease_weights[i];
            c.crease_pairs[2 * to] = c.crease_pairs[2 * i];
            c.crease_pairs[2 * to + 1] = c.crease_pairs[2 * i + 1];
            to++;
        }
    c.crease_weights.resize(to);
    c.crease_pairs.resize(2 * to);
    to = 0;
    for (size_t i = 0; i < c.corner_weights.size(); i++)
        if (c.corner_weights[i] > 0) {
            c.corner_weights[to] = c.corner_weights[i];
            c.corner_vertices[to++] = c.corner_vertices[i];
        }
    c.corner_weights.resize(to);
    c.corner_vertices.resize(to);
}

void EditedCage::refine_values(const osd::Far::TopologyRefiner& refiner, const osd::Far::TopologyLevel& fine,
                               std::vector<FaceVaryingChannel>& channels) {
    const osd::Far::PrimvarRefiner interpolate(refiner);
    const size_t vertices = size_t(fine.GetNumVertices()), faces = size_t(fine.GetNumFaces());
    std::vector<float> xyz(3 * vertices);
    {
        Rows from{m_points.xyz.data(), 3}, to{xyz.data(), 3};
        interpolate.Interpolate(1, from, to);
    }
    m_points.xyz = std::move(xyz);
    size_t channel = 0;
    for (Primvar& p : m_primvars.list) {
        const int n = p.components;
        std::vector<float> values;
        if (p.detail == scene::Detail::Uniform) {
            values.resize(faces * size_t(n));
            for (size_t f = 0; f < faces; f++)
                std::copy_n(&p.values[size_t(fine.GetFaceParentFace(int(f))) * n], n, &values[f * n]);
        } else if (is_face_varying(p)) {
            const int k = int(channel);
            std::vector<float> refined(size_t(fine.GetNumFVarValues(k)) * size_t(n));
            Rows from{channels[channel].values.data(), n}, to{refined.data(), n};
            interpolate.InterpolateFaceVarying(1, from, to, k);
            for (size_t f = 0; f < faces; f++)
                for (const int i : fine.GetFaceFVarValues(int(f), k))
                    values.insert(values.end(), &refined[size_t(i) * n], &refined[size_t(i) * n] + n);
            channel++;
        } else {
            values.resize(vertices * size_t(n));
            Rows from{const_cast<float*>(p.values.data()), n}, to{values.data(), n}; // read alone
            if (p.detail == scene::Detail::Vertex)
                interpolate.Interpolate(1, from, to);
            else
                interpolate.InterpolateVarying(1, from, to);
        }
        p.values = std::move(values);
    }
}

void EditedCage::refine_topology(const osd::Far::TopologyLevel& coarse, const osd::Far::TopologyLevel& fine) {
    Cage next;
    next.faces = m_cage.faces;
    next.corners = m_cage.corners;
    next.scheme = m_cage.scheme;
    next.options = m_cage.options;
    next.own_uniform = true;
    next.first.push_back(0);
    next.ranges.resize(size_t(fine.GetNumFaces()));
    for (int f = 0; f < fine.GetNumFaces(); f++) {
        const auto vertices = fine.GetFaceVertices(f);
        const int parent = fine.GetFaceParentFace(f);
        next.vertices.insert(next.vertices.end(), vertices.begin(), vertices.end());
        next.corner.push_back(next.first.back());
        next.first.push_back(int(next.vertices.size()));
        next.sizes.push_back(vertices.size());
        next.face.push_back(m_cage.face[parent]);
        if (m_cage.sizes[parent] == 4) { // those of an n-gon are its quads at corners
            const auto children = coarse.GetFaceChildFaces(parent);
            const int k = int(std::find(children.begin(), children.end(), f) - children.begin());
            const FaceRange& r = m_cage.ranges[parent];
            const float u = (r.u0 + r.u1) / 2, v = (r.v0 + r.v1) / 2;
            const bool right = k == 1 || k == 2, upper = k >= 2;
            next.ranges[f] = {right ? u : r.u0, right ? r.u1 : u, upper ? v : r.v0, upper ? r.v1 : v};
        }
        if (fine.IsFaceHole(f))
            next.holes.push_back(f);
    }
    for (int e = 0; e < fine.GetNumEdges(); e++)
        if (const float s = fine.GetEdgeSharpness(e); s > 0 && !fine.IsEdgeBoundary(e)) {
            const auto ends = fine.GetEdgeVertices(e);
            next.crease_pairs.insert(next.crease_pairs.end(), {ends[0], ends[1]});
            next.crease_weights.push_back(s);
        }
    for (int v = 0; v < fine.GetNumVertices(); v++)
        if (const float s = fine.GetVertexSharpness(v); s > 0) {
            next.corner_vertices.push_back(v);
            next.corner_weights.push_back(s);
        }
    m_cage = std::move(next);
    m_crease.clear();
    m_corner.clear();
    m_level_known = false;
}

void EditedCage::know_level() {
    if (m_level_known)
        return;
    m_level_known = true;
    for (size_t i = 0; i < m_cage.crease_weights.size(); i++)
        m_crease[std::minmax(m_cage.crease_pairs[2 * i], m_cage.crease_pairs[2 * i + 1])] = i;
    for (size_t i = 0; i < m_cage.corner_weights.size(); i++)
        m_corner[m_cage.corner_vertices[i]] = i;
}
void EditedCage::set_crease(int a, int b, How how, float value) {
    know_level();
    const auto [at, fresh] = m_crease.try_emplace(std::minmax(a, b), m_cage.crease_weights.size());
    if (fresh) {
        m_cage.crease_pairs.insert(m_cage.crease_pairs.end(), {a, b});
        m_cage.crease_weights.push_back(0);
    }
    float& s = m_cage.crease_weights[at->second];
    s = sharpness_in_range(changed(how, s, value));
}
void EditedCage::set_corner(int vertex, How how, float value) {
    know_level();
    const auto [at, fresh] = m_corner.try_emplace(vertex, m_cage.corner_weights.size());
    if (fresh) {
        m_cage.corner_vertices.push_back(vertex);
        m_cage.corner_weights.push_back(0);
    }
    float& s = m_cage.corner_weights[at->second];
    s = sharpness_in_range(changed(how, s, value));
}

void EditedCage::change_value(const Edit& e, int vertex, int corner, const std::vector<float>& values) {
    const Operation& o = e.operation;
    const size_t n = size_t(o.width);
    const auto change = [&](float* data) {
        for (size_t c = 0; c < n; c++)
            data[c] = changed(o.how, data[c], values[c]);
    };
    if (o.primvar < 0) {
        change(&m_points.xyz[size_t(vertex) * 3]);
        return;
    }
    Primvar& p = m_primvars.list[size_t(o.primvar)];
    std::vector<float>& data = writable(size_t(o.primvar));
    if (p.detail == scene::Detail::Uniform) {
        change(&data[size_t(e.face) * n]);
    } else if (!is_face_varying(p)) {
        change(&data[size_t(vertex) * n]);
    } else {
        // All corners of the vertex that had this one's value: a seam stays one.
        const std::vector<float> old(&data[size_t(corner) * n], &data[size_t(corner) * n] + n);
        for (size_t i = 0; i < m_cage.vertices.size(); i++)
            if (m_cage.vertices[i] == vertex && std::memcmp(&data[i * n], old.data(), n * sizeof(float)) == 0)
                change(&data[i * n]);
    }
}

// Buffers cannot be written: an edited primvar's data are kept aside until the level is done.
std::vector<float>& EditedCage::writable(size_t primvar) {
    auto [at, fresh] = m_written.try_emplace(primvar);
    if (fresh) {
        const scene::Buffer<float>& values = m_primvars.list[primvar].values;
        at->second.assign(values.begin(), values.end());
    }
    return at->second;
}

} // namespace kanuka::geom
