// Reading the arguments of a call from generated code.
#pragma once

#include "sl/ops/runtime.h"

namespace kanuka::sl::ops {

// Pointers to the components of the arguments, then of the result.
struct Arguments {
    const ir::Stage& stage;
    const ir::CallSite& site;
    void** pointers;

    int first(int k) const {
        int n = 0;
        for (int i = 0; i < k; i++)
            n += ir::comps(stage.instrs[size_t(site.args[size_t(i)])].ty);
        return n;
    }
    const float* const* at(int k) const { return reinterpret_cast<const float* const*>(pointers + first(k)); }
    const char* text(int k) const {
        const char* s = *static_cast<const char* const*>(pointers[first(k)]);
        return s ? s : "";
    }
    float* const* result() const {
        return reinterpret_cast<float* const*>(pointers + first(int(site.args.size())));
    }
    void set_text(const char* s) const {
        *static_cast<const char**>(pointers[first(int(site.args.size()))]) = s;
    }
};

void host_call(Runner& runner, const Frame& frame, const Arguments& arguments);
void differences(Runner& runner, const Arguments& arguments); // derivatives.cpp
void calculate_normal(Runner& runner, const Arguments& arguments);
void build_call(Runner& runner, const Arguments& arguments); // build.cpp: materials

} // namespace kanuka::sl::ops
