// What the processor can do beyond the floor that everything is compiled for, x86-64-v3.
#pragma once

#include <cstdlib>
#include <string_view>

namespace kanuka {

// x86-64-v4, which some kernels are built for as well. KANUKA_ISA=avx2 turns it off: pictures are the same,
// to the bit.
inline bool has_avx512() {
    static const bool has = [] {
        const char* isa = std::getenv("KANUKA_ISA");
        return !(isa && std::string_view(isa) == "avx2") && __builtin_cpu_supports("avx512f") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
               __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    }();
    return has;
}

} // namespace kanuka
