#include "sl/codegen/host_symbols.h"

#include <cstring>
#include <string>
#include <unordered_map>

#include "sl/codegen/frame.h"
#include "sl/ops/noise.h"

// libmvec's functions, by address only.
#define KANUKA_MATH(X)                                                                                       \
    X(v_sin)                                                                                                 \
    X(v_cos)                                                                                                 \
    X(v_tan)                                                                                                 \
    X(v_asin)                                                                                                \
    X(v_acos) X(v_atan) X(v_exp) X(v_log) X(v_log2) X(v_log10) X(v_exp2) X(v_cbrt) X(vv_pow) X(vv_atan2)
#define KANUKA_DECLARE(name) void _ZGVdN8##name##f();
extern "C" {
KANUKA_MATH(KANUKA_DECLARE)
}

namespace kanuka::sl {

namespace {

using Map = std::unordered_map<std::string, void*>;

Map make_map() {
    Map map;
    const auto function = [&](const std::string& name, auto* f) { map[name] = reinterpret_cast<void*>(f); };
    function("kanuka_sl_call", &kanuka_sl_call);
    function("kanuka_sl_fault", &kanuka_sl_fault);
    function("kanuka_sl_any", &kanuka_sl_any);
    function("kanuka_sl_same", &kanuka_sl_same);
#define KANUKA_ADD(name) function("_ZGVdN8" #name "f", &_ZGVdN8##name##f);
    KANUKA_MATH(KANUKA_ADD)
    // What the code generator may call by itself.
    function("memcpy", &memcpy);
    function("memset", &memset);
    function("memmove", &memmove);
    for (size_t k = 0; k < ops::noise_kernels().size(); k++)
        for (int width : {1, 8, 16})
            if (ops::NoiseFunction f = ops::noise_function(int(k), width))
                function("kanuka_" + std::string(ops::noise_kernels()[k].symbol) + "_w" +
                             std::to_string(width),
                         f);
    return map;
}

} // namespace

void* host_symbol(std::string_view name) {
    static const Map map = make_map();
    const auto it = map.find(std::string(name));
    return it == map.end() ? nullptr : it->second;
}

} // namespace kanuka::sl
