// Fuzzes the shading language's front end with libFuzzer (clang):
//
//   cmake -S . -B build-fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++-19 -DKANUKA_FUZZ=ON \
//         -DKANUKA_SANITIZE=fuzzer-no-link,address,undefined -DKANUKA_TESTS=OFF -DKANUKA_PYTHON=OFF
//   ninja -C build-fuzz sl_fuzz
//   build-fuzz/tests/fuzz/sl_fuzz -dict=tests/fuzz/sl.dict -timeout=20 -rss_limit_mb=4096 CORPUS shaders
//   tests/shaders
//
// An input is a shader's text; one that begins with the byte 1 is the inside of a published shader, with 2 of
// a cache entry. Includes are out of reach: names in the input must not make it read the machine's files.

#include <cstddef>
#include <cstdint>
#include <string>

#include "sl/frontend.h"
#include "sl/ir/plan.h"
#include "sl/print/print.h"
#include "sl/summary.h"

namespace {

using namespace kanuka;
using namespace kanuka::sl;

size_t all_steps(FrontEnd& front, bool linked = false) {
    size_t made = 0;
    if (!front.check())
        return made;
    made += print_tree(front.shader(), front.sources()).size();
    const std::optional<ir::Program> program = front.lower();
    if (!program)
        return made;
    for (const ir::Stage* stage : program->stages()) {
        if (!stage->root)
            continue;
        ir::Stage s = *stage;
        ir::infer_detail(s, all_varying(*program), nullptr);
        made += print_c(*program, s, front.sources()).size();
        ir::make_masks(s);
        const ir::Plan plan = ir::make_plan(s);
        made += print_ir(*program, s, plan, front.sources()).size();
    }
    if (linked)
        return made;
    const std::string slo = write_slo(front.sources(), front.source(), *program);
    Journal journal;
    FrontEnd again("again.slo", slo, {}, journal);
    if (!again.lower())
        __builtin_trap(); // what compiles, compiles after it was published
    return made + slo.size();
}

// The shader with itself as two co-shaders, connected in a circle by whatever parameters it has.
size_t link_with_itself(const std::string& text, Journal& journal) {
    FrontEnd alone("/nonexistent/fuzz.sl", text, {}, journal);
    const std::optional<ir::Program> program = alone.lower();
    if (!program || program->coshaders == CoShaderUse::None)
        return 0;
    CompileOptions options;
    const auto connect = [&](const char* handle) {
        std::vector<Connection> all;
        for (const Parameter& p : program->parameters)
            if (p.type == Type::Shader)
                all.push_back({p.name, std::vector<std::string>(size_t(std::max(1, p.array_size)), handle)});
        return all;
    };
    options.connections = connect("a");
    options.coshaders = {{"a", "/nonexistent/a.sl", text, "x, y", connect("b")},
                         {"b", "/nonexistent/b.sl", text, "x", connect("a")}};
    FrontEnd front("/nonexistent/fuzz.sl", text, options, journal);
    return all_steps(front, true);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    std::string text(reinterpret_cast<const char*>(data), size);
    if (text.find("\"/") != std::string::npos || text.find("</") != std::string::npos ||
        text.find("..") != std::string::npos)
        return 0;
    Journal journal;
    if (!text.empty() && text[0] == 1) {
        Published published;
        published.tokens = text.substr(1);
        Sources sources;
        std::string problem;
        const Preprocessed p = unpack(published, sources, problem);
        return problem.empty() && p.tokens.empty();
    }
    if (!text.empty() && text[0] == 2) {
        Summary summary;
        std::string_view object;
        return unpack_entry(std::string_view(text).substr(1), true, "x.sl", summary, object) &&
               object.empty();
    }
    try {
        FrontEnd front("/nonexistent/fuzz.sl", text, {}, journal);
        return all_steps(front) + link_with_itself(text, journal) == 1;
    } catch (const Error&) { // a damaged .slo
        return 0;
    }
}
