// Shaded grids made by hand, for the tests of this folder.
#pragma once

#include <random>

#include "store/store.h"

namespace kanuka::store::testing {

// A shading lattice of nu x nv cells over [0, nu] x [0, nv] in the plane z = 0, traced one to one, with
// inputs to fill.
struct HandMade {
    grid::Grid grid;
    grid::TracedGrid traced;
    grid::TracedMesh mesh;
    bool is_mesh = false;
    grid::VertexInputs inputs;

    HandMade(int nu, int nv, const grid::LayeringProgram& program) {
        grid.allocate(nu, nv);
        traced.mu = nu, traced.mv = nv;
        for (int j = 0; j <= nv; j++)
            for (int i = 0; i <= nu; i++) {
                const size_t at = size_t(j * (nu + 1) + i);
                grid.P[at] = float(i);
                grid.P[size_t(grid.stride) + at] = float(j);
                grid.N[size_t(grid.stride) * 2 + at] = 1;
                for (float f : {float(i), float(j), 0.0f})
                    traced.P.push_back(f);
            }
        inputs.stride = grid.stride;
        for (const grid::Slot& s : program.slots) {
            const size_t components = size_t(grid::components_of(s.type));
            inputs.slots.push_back(
                {false, Vec3f(0.0f), std::vector<float>(components * size_t(grid.stride), 0.5f)});
        }
    }
    float& at(size_t slot, int component, int vertex) {
        return inputs.slots[slot].data[size_t(component * inputs.stride + vertex)];
    }
    void set_uniform(size_t slot, Vec3f value) { inputs.slots[slot] = {true, value, {}}; }
    void scramble(uint32_t seed) {
        std::mt19937 g(seed);
        std::uniform_real_distribution<float> u(0, 1);
        for (auto& s : inputs.slots)
            for (float& f : s.data)
                f = u(g);
        for (int i = 0; i < grid.vertices(); i++)
            for (int c = 0; c < 3; c++)
                grid.N[size_t(c * grid.stride + i)] = u(g) + 0.1f;
    }
    ShadedGrid shaded() const {
        return {&grid, is_mesh ? nullptr : &traced, is_mesh ? &mesh : nullptr, &inputs};
    }
};

// Lambertian reflection and emission, cut out by presence. Slots: 0 reflectance, 1 weight, 2 radiance, 3
// presence.
inline grid::LayeringProgram lamp_program() {
    using namespace grid;
    LayeringProgram p;
    p.slots = {
        {InputType::Color, Storage::Color, 0, 1, false, "reflectance"},
        {InputType::Float, Storage::Half, 0, 1, false, "weight"},
        {InputType::Color, Storage::Amount, 0, std::numeric_limits<float>::infinity(), false, "radiance"},
        {InputType::Float, Storage::Half, 0, 1, false, "presence"}};
    LayerNode diffuse, glow, both;
    diffuse.lobe = LobeId::LambertBrdf;
    diffuse.inputs = {0};
    diffuse.weight = 1;
    glow.lobe = LobeId::DiffuseEmission;
    glow.inputs = {2};
    both.op = LayerOp::Add;
    both.upper = 0;
    both.lower = 1;
    p.nodes = {diffuse, glow, both};
    p.presence = 3;
    return p;
}

inline Page encode_one(const HandMade& made, const grid::LayeringProgram& program, uint64_t* bad = nullptr) {
    const ShadedGrid shaded[] = {made.shaded()};
    uint64_t count = 0;
    Page page = encode(shaded, program, count);
    if (bad)
        *bad = count;
    return page;
}

} // namespace kanuka::store::testing
