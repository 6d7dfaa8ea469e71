// Search paths: folders separated by colons, "&" for the path as it was, "@" for the default, $NAME for the
// environment.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kanuka::ingest {

// Relative folders are meant from the file that sets the path, or, as other renderers read them, from the
// working directory: both are tried, in this order.
std::vector<std::string> expand_search_path(std::string_view text, const std::vector<std::string>& previous,
                                            const std::vector<std::string>& defaults,
                                            const std::string& folder);

// The first of folder/name that is a file; an absolute name stands for itself. nullopt = there is none.
std::optional<std::string> find_file(const std::string& name, const std::vector<std::string>& folders);

std::string folder_of(const std::string& path);                            // "" = the working directory
std::string join_path(const std::string& folder, const std::string& name); // an absolute name stays as it is

} // namespace kanuka::ingest
