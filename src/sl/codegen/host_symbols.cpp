#include "sl/codegen/host_symbols.h"

#include <cstring>
#include <string>
#include <unordered_map>

#include "sl/codegen/frame.h"
#include "sl/ops/noise.h"

// libmvec's functions, by address only.
#define KANUKA_MATH1(X)                                                                                      \
    X(sin) X(cos) X(tan) X(asin) X(acos) X(atan) X(exp) X(log) X(log2) X(log10) X(exp2) X(cbrt)
#define KANUKA_DECLARE1(name)                                                                                \
    void _ZGVdN8v_##name##f();                                                                               \
    void _ZGVeN16v_##name##f();                                                                              \
    float name##f(float);
extern "C" {
#undef log
KANUKA_MATH1(KANUKA_DECLARE1)
void _ZGVdN8vv_powf();
void _ZGVdN8vv_atan2f();
void _ZGVeN16vv_powf();
void _ZGVeN16vv_atan2f();
float powf(float, float);
float atan2f(float, float);
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
#define KANUKA_ADD1(name)                                                                                    \
    function("_ZGVdN8v_" #name "f", &_ZGVdN8v_##name##f);                                                    \
    function("_ZGVeN16v_" #name "f", &_ZGVeN16v_##name##f);                                                  \
    function(#name "f", &::name##f);
    KANUKA_MATH1(KANUKA_ADD1)
    function("_ZGVdN8vv_powf", &_ZGVdN8vv_powf);
    function("_ZGVeN16vv_powf", &_ZGVeN16vv_powf);
    function("powf", &::powf);
    function("_ZGVdN8vv_atan2f", &_ZGVdN8vv_atan2f);
    function("_ZGVeN16vv_atan2f", &_ZGVeN16vv_atan2f);
    function("atan2f", &::atan2f);
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
