// What compiled stages and the host share while a stage runs. The layout is read by generated code: emit.cpp
// names the fields by index.
#pragma once

#include <cstdint>

namespace kanuka::sl {

struct Frame {
    int32_t count;               // vertices
    int32_t padding;             // keeps the pointers aligned
    int64_t stride;              // floats between arrays of scratch
    float* uniforms;             // values of the stage that outlive one region; one a grid
    const char** texts;          // the same for strings
    float* scratch;              // arrays, one value a vertex
    const float* const* inputs;  // a pointer for each component of each input that may vary
    const float* uniform_inputs; // values of all inputs that are uniform, at the same index
    const float* params;
    const char* const* param_texts;
    const float* const* varying_params; // by offset in params; null where uniform
    const float* members;
    const char* const* member_texts;
    const float* channels; // values before any SetLobe: three floats a channel
    float* const* outputs; // by index of the stage's output, 16 a piece; null = not wanted
    void* host;            // the Runner
    int64_t budget;        // iterations that are left; below zero: a loop did not end
    int64_t patience;      // iterations that one loop may have
};

// What generated code calls. `args` has a pointer for each component of each argument, then of the result.
extern "C" {
void kanuka_sl_call(Frame* frame, int32_t site, void** args);
void kanuka_sl_fault(Frame* frame, int32_t fault, int32_t lanes);
int32_t kanuka_sl_any(const Frame* frame, const float* mask);
int32_t kanuka_sl_same(const char* a, const char* b);
}

using StageFunction = void (*)(Frame*);

} // namespace kanuka::sl
