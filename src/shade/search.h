// Where shaders and textures are looked for.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"

namespace kanuka::shade {

// The folders of a search path in order, then the scene file's folder, then `last` (if not empty). A relative
// folder counts from the working directory first, then from the scene file's folder. "@" stands for `last`.
std::vector<std::string> search_folders(const std::vector<std::string>& path, const std::string& scene_file,
                                        const std::string& last);

// The first file FOLDER/NAME+EXTENSION there is; all extensions are tried in one folder before the next.
// Absolute names are taken as they are. Files that `serves` refuses are passed over.
std::optional<std::string> find_file(const std::string& name, std::span<const std::string> folders,
                                     std::span<const char* const> extensions,
                                     const std::function<bool(const std::string&)>& serves = nullptr);

std::string join_folders(std::span<const std::string> folders); // "a", "b", for messages

// What is said of a file that is not there: "searched in "a", "b". Add its folder: …", the last in the words
// of RIB, or of Python where no file asked for it. `kind`: "shader" or "texture".
std::string searched_in(std::span<const std::string> folders, const std::string& kind, const Location& asker);
// "; did you mean "matte"?": a file there whose name is much the same. Empty = none is.
std::string did_you_mean(const std::string& name, std::span<const std::string> folders,
                         std::span<const char* const> extensions);

} // namespace kanuka::shade
