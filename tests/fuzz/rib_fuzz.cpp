// Fuzzes the RIB reader with libFuzzer (clang):
//
//   cmake -S . -B build-fuzz -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=clang++-19
//   -DKANUKA_FUZZ=ON \
//         -DKANUKA_SANITIZE=fuzzer-no-link,address,undefined -DKANUKA_TESTS=OFF -DKANUKA_PYTHON=OFF
//   ninja -C build-fuzz rib_fuzz && build-fuzz/tests/fuzz/rib_fuzz -dict=tests/fuzz/rib.dict CORPUS
//
// Archives on disk are out of reach: names in the input must not make it read the machine's files.

#include <cstddef>
#include <cstdint>
#include <string>

#include "ingest/rib/convert.h"
#include "ingest/rib/rib.h"
#include "scene/summary.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace kanuka;
    constexpr size_t Longest = 8192; // longer inputs find nothing that short ones do not, and cost more
    if (size > Longest)
        return -1;
    const std::string text(reinterpret_cast<const char*>(data), size);
    if (text.find("Archive \"/") != std::string::npos || text.find("..") != std::string::npos)
        return -1;
    Journal journal;
    scene::Scene scene;
    ingest::RibOptions options;
    options.run_programs =
        false; // names in the input start nothing; waiting for programs took most of the time
    options.most_procedurals = 64;
    try {
        scene = ingest::parse_rib(text, "/nonexistent/fuzz.rib", options, journal);
    } catch (const Error&) { // ErrorHandler "abort"
        return 0;
    }
    const scene::Summary summary = scene::summarize(scene);
    if (scene::to_json(summary).empty() || scene::to_text(summary).empty())
        __builtin_trap();
    // What a writer writes is a fixed point: canonical text says the same again, by way of binary too. That
    // reads four times more, so it is held for one input in eight, chosen by what stands in it.
    uint32_t sum = 0;
    for (size_t i = 0; i < size; i++)
        sum = sum * 31 + data[i];
    if ((sum >> 8) % 8 != 0)
        return 0;
    Journal converted;
    const std::string ascii = ingest::convert_text(text, "/nonexistent/fuzz.rib", {}, converted);
    const std::string binary =
        ingest::convert_text(ascii, "/nonexistent/fuzz.rib", {.binary = true}, converted);
    if (ingest::convert_text(ascii, "/nonexistent/fuzz.rib", {}, converted) != ascii ||
        ingest::convert_text(binary, "/nonexistent/fuzz.rib", {}, converted) != ascii)
        __builtin_trap();
    return 0;
}
