// The rows of the shadeop table; shadeops.cpp reads them. In a signature, "T" stands for each of float,
// color, point, vector, normal in turn, "V" for each of point, vector, normal.
#pragma once

#include "sl/ops/noise.h"
#include "sl/ops/shadeops.h"

namespace kanuka::sl::ops {

struct Row {
    std::string_view category;
    std::string_view header; // one signature; rows of one name belong together
    Impl impl;
    ir::Op op;
    int imm;
    std::string_view source; // body
    std::string_view doc;    // of the first row of a name
    Special special = Special::Absent;
    Optics optics = Optics::None; // of the first row of a name
};

std::span<const Row> rows();

} // namespace kanuka::sl::ops
