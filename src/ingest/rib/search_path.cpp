#include "ingest/rib/search_path.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>

#include "ingest/rib/zip.h"

namespace kanuka::ingest {

namespace fs = std::filesystem;

std::string folder_of(const std::string& path) {
    // Of a zip's member: "a.zip!" or a folder in it.
    const size_t slash = path.rfind('/'), mark = path.rfind(".zip!");
    if (mark != std::string::npos && (slash == std::string::npos || slash < mark))
        return path.substr(0, mark + 5);
    return slash == std::string::npos ? "" : slash == 0 ? "/" : path.substr(0, slash);
}

std::string join_path(const std::string& folder, const std::string& name) {
    if (folder.empty() || folder == "." || (!name.empty() && name[0] == '/'))
        return name;
    if (name == ".")
        return folder;
    return folder.back() == '/' || folder.ends_with(".zip!") ? folder + name : folder + "/" + name;
}

// $NAME and ${NAME}, and ~ at the start. An unset variable is empty, as in a shell.
static std::string expand_environment(std::string_view text) {
    std::string out;
    for (size_t i = 0; i < text.size(); i++) {
        if (text[i] == '~' && i == 0 && (text.size() == 1 || text[1] == '/')) {
            const char* home = std::getenv("HOME");
            out += home ? home : "~";
            continue;
        }
        if (text[i] != '$' || i + 1 >= text.size()) {
            out += text[i];
            continue;
        }
        const bool braces = text[i + 1] == '{';
        size_t start = i + 1 + braces, stop = start;
        while (stop < text.size() &&
               (std::isalnum(static_cast<unsigned char>(text[stop])) || text[stop] == '_'))
            stop++;
        if (stop == start) {
            out += text[i];
            continue;
        }
        const char* value = std::getenv(std::string(text.substr(start, stop - start)).c_str());
        out += value ? value : "";
        i = stop - 1 + (braces && stop < text.size() && text[stop] == '}');
    }
    return out;
}

std::vector<std::string> expand_search_path(std::string_view text, const std::vector<std::string>& previous,
                                            const std::vector<std::string>& defaults,
                                            const std::string& folder) {
    std::vector<std::string> path;
    const auto add = [&](const std::string& entry) {
        if (!entry.empty() && std::find(path.begin(), path.end(), entry) == path.end())
            path.push_back(entry);
    };
    // "&" in the wild stands alone between colons, or glued to a folder ("&:shaders").
    for (size_t at = 0; at <= text.size();) {
        const size_t stop = std::min(text.find(':', at), text.size());
        const std::string_view entry = text.substr(at, stop - at);
        at = stop + 1;
        if (entry == "&") {
            for (const std::string& p : previous)
                add(p);
        } else if (entry == "@") {
            for (const std::string& p : defaults)
                add(p);
        } else {
            const std::string expanded = expand_environment(entry);
            if (expanded.empty())
                continue;
            add(join_path(folder, expanded));
            add(expanded);
        }
    }
    return path;
}

std::optional<std::string> find_file(const std::string& name, const std::vector<std::string>& folders) {
    std::error_code ignored;
    const auto in_folders = [&](const std::string& relative) -> std::optional<std::string> {
        for (const std::string& folder : folders) {
            std::string path = join_path(folder, relative);
            if (const auto zipped = split_zip(path)) {
                if (zip_has(zipped->first, zipped->second))
                    return path;
            } else if (fs::exists(path, ignored) && !fs::is_directory(path, ignored)) {
                return path;
            }
        }
        return std::nullopt;
    };
    const bool drive = name.size() > 2 && std::isalpha(static_cast<unsigned char>(name[0])) &&
                       name[1] == ':' && (name[2] == '/' || name[2] == '\\');
    if (!drive && (name.empty() || name[0] != '/'))
        return in_folders(name);
    if (!drive && (fs::exists(name, ignored) || in_folders(name)))
        return name;
    // A path of the machine that the file was written on: its end may be here, the longer the better.
    std::string tail = name;
    std::replace(tail.begin(), tail.end(), '\\', '/');
    for (size_t slash = tail.find('/'); slash != std::string::npos; slash = tail.find('/')) {
        tail.erase(0, slash + 1);
        if (!tail.empty() && tail[0] != '/')
            if (auto found = in_folders(tail))
                return found;
    }
    return std::nullopt;
}

} // namespace kanuka::ingest
