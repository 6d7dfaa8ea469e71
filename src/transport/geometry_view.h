// Shapes, their materials and the rays that find them, as kernels read them.
#pragma once

#include <span>

#include "bsdf/material.h"
#include "store/store.h"
#include "transport/ray_query.h"
#include "transport/variation_row.h"

namespace kanuka::transport {

struct GeometryView {
    const int32_t* shapes = nullptr; // ShapeRecord as words
    const store::Emitter* emitters = nullptr;
    const store::Links* links = nullptr; // ShapeRecord::links
    RayQuery ray_query;
    std::span<const bsdf::MaterialCode> materials; // by program
    bool instanced = false;
    const VariationRow* variations = nullptr; // by bvh::HitPacket::variation; null = no instance has one
    bool moving = false;                      // paths have a time: something moves while the shutter is open
    bool tinted = false; // some shape stops some colours more than others: store::ShapeRecord::Tinted
    // Some shape has it: store::Links::seen, and levels of detail in transition, or some instance.
    bool holds_out = false, hides = false, fades = false, backdrops = false;
};

} // namespace kanuka::transport
