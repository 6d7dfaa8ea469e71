#include "render/motion.h"

#include <cmath>

namespace kanuka::render {

namespace {

constexpr int MostPieces = 16; // of a changing shape: every one costs its positions and normals again

scene::Buffer<float> mix(const scene::Buffer<float>& a, const scene::Buffer<float>& b, float f) {
    if (f <= 0 || a.size() != b.size())
        return a;
    if (f >= 1)
        return b;
    std::vector<float> out(a.size());
    for (size_t i = 0; i < out.size(); i++)
        out[i] = a[i] + (b[i] - a[i]) * f;
    return out;
}

// The primitive with its shape between two samples.
void take_shape(scene::Primitive& p, const scene::Motion::Shape& a, const scene::Motion::Shape& b, float f) {
    p.geometry = a.geometry;
    p.primvars = a.primvars;
    if (auto* q = std::get_if<scene::Quadric>(&p.geometry))
        if (const auto* to = std::get_if<scene::Quadric>(&b.geometry))
            for (size_t i = 0; i < std::min(q->arguments.size(), to->arguments.size()); i++)
                q->arguments[i] += (to->arguments[i] - q->arguments[i]) * f;
    for (scene::Value& v : p.primvars.values)
        if (const scene::Value* to = b.primvars.find(v.name))
            v.floats = mix(v.floats, to->floats, f);
}

void shape_at(scene::Primitive& p, const std::vector<scene::Motion::Shape>& shapes, double time) {
    size_t i = 0;
    while (i + 2 < shapes.size() && shapes[i + 1].time <= time)
        i++;
    const auto &a = shapes[i], &b = shapes[std::min(i + 1, shapes.size() - 1)];
    const double span = b.time - a.time;
    take_shape(p, a, b, span > 0 ? float(std::clamp((time - a.time) / span, 0.0, 1.0)) : 0.0f);
}

} // namespace

int even_pieces(std::span<const double> times, int most) {
    constexpr double Near = 0.01; // of a piece
    for (int n = 1; n <= most; n++) {
        bool fits = true;
        for (const double t : times)
            if (t > 0 && t < 1)
                fits = fits && std::abs(t * n - std::round(t * n)) <= Near;
        if (fits)
            return n;
    }
    return most;
}

std::vector<TransformKey> keys_in_shutter(std::span<const TransformKey> keys, const Shutter& shutter) {
    std::vector<TransformKey> out;
    if (!shutter.blurs() || keys.size() < 2)
        return out;
    const MotionPath path(keys);
    bool moves = !(path.at(shutter.open) == path.at(shutter.close));
    for (const TransformKey& k : keys) {
        out.push_back({shutter.fraction(k.time), k.transform});
        if (k.time > shutter.open && k.time < shutter.close)
            moves |= !(path.at(k.time) == path.at(shutter.open));
    }
    if (!moves)
        out.clear();
    return out;
}

MovingPrimitive in_shutter(const scene::Primitive& primitive, const Shutter& shutter) {
    MovingPrimitive out;
    out.rest = primitive;
    out.rest.motion = nullptr;
    if (!primitive.motion)
        return out;
    const scene::Motion& motion = *primitive.motion;
    if (!motion.places.empty())
        out.rest.world_from_object = MotionPath(motion.places).at(shutter.open);
    out.places = keys_in_shutter(motion.places, shutter);
    if (motion.shapes.size() < 2)
        return out;
    shape_at(out.rest, motion.shapes, shutter.open);
    if (!shutter.blurs() || motion.shapes.front().time >= shutter.close ||
        motion.shapes.back().time <= shutter.open)
        return out;
    std::vector<double> times;
    for (const auto& shape : motion.shapes)
        times.push_back(shutter.fraction(shape.time));
    const int pieces = even_pieces(times, MostPieces);
    for (int k = 1; k <= pieces; k++) {
        out.later.push_back(out.rest);
        shape_at(out.later.back(), motion.shapes, shutter.open + (shutter.close - shutter.open) * k / pieces);
    }
    return out;
}

} // namespace kanuka::render
