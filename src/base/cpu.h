// What the processor can do beyond the floor that everything is compiled for, x86-64-v3.
#pragma once

namespace kanuka {

// x86-64-v4, which 16 lanes are built for.
inline bool has_avx512() {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
}

} // namespace kanuka
