// Published shaders, NAME.slo: the preprocessed tokens with their places, the lines that messages show, and
// what the shader is, to be read without compiling it. The only thing an asset ships.
//
//   "KNKSLO" LF version LF │ sizes, checksum │ metadata: JSON, zlib │ tokens and sources, zlib
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "sl/ir/ir.h"
#include "sl/parse/token.h"
#include "sl/sl.h" // is_slo()

namespace kanuka::sl {

struct Published {
    std::string metadata; // JSON
    std::string tokens;   // unpack() reads them
    uint64_t hash = 0;    // of the tokens, as the preprocessor made it
};

// Nothing, and what is wrong, if the file is damaged or of a version that is not known. Without the tokens
// where only the metadata is wanted.
std::optional<Published> read_slo(std::string_view bytes, std::string& problem, bool metadata_alone = false);
Preprocessed unpack(const Published& published, Sources& sources, std::string& problem);
std::string write_slo(const Sources& sources, const Preprocessed& source, const ir::Program& program);

} // namespace kanuka::sl
