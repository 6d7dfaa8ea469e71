// Members of zip files, which RenderMan for Maya keeps archives in: "geometry.zip!shapes/ball.rib".
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace kanuka::ingest {

// The zip file and the member that a name means; nullopt = it means a plain file.
std::optional<std::pair<std::string, std::string>> split_zip(const std::string& name);

// Is there such a member? False where the zip cannot be read, too.
bool zip_has(const std::string& zip, std::string_view member);

// Hands on the bytes of a member, piece by piece: stored ones at once, deflated ones unpacked. Throws Error
// with what is wrong; never gives more bytes than the zip's directory says.
void read_zip(const std::string& zip, const std::string& member,
              const std::function<void(std::string_view)>& piece);

} // namespace kanuka::ingest
