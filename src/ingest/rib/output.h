// Where bytes of a RIB go: a file, plain or packed, standard output, or a string.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace kanuka::ingest {

enum class Packing : uint8_t { None, Gzip, Zstd };
Packing packing_by_name(std::string_view path); // .gz, .zst

// Thread safety: none.
class Output {
  public:
    virtual ~Output() = default;
    virtual void write(std::string_view bytes) = 0;
    // The file appears under its name here, complete; without it there is none. Throws Error.
    virtual void finish() = 0;
};

// "-" is standard output. Throws Error with ExitCode::Output where the file cannot be written.
std::unique_ptr<Output> open_output(const std::string& path, Packing packing);
std::unique_ptr<Output> output_to(std::string& text);

} // namespace kanuka::ingest
