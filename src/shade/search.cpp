#include "shade/search.h"

#include <algorithm>
#include <filesystem>

namespace fs = std::filesystem;

namespace kanuka::shade {

namespace {

void add_once(std::vector<std::string>& folders, const std::string& folder) {
    if (std::find(folders.begin(), folders.end(), folder) == folders.end())
        folders.push_back(folder);
}

bool is_file(const fs::path& path) {
    std::error_code failed; // unreadable folders and over-long names count as "not there"
    return fs::is_regular_file(path, failed);
}

} // namespace

std::vector<std::string> search_folders(const std::vector<std::string>& path, const std::string& scene_file,
                                        const std::string& last) {
    fs::path scene_folder = fs::path(scene_file).parent_path();
    if (scene_folder.empty())
        scene_folder = ".";
    std::vector<std::string> folders;
    for (const std::string& entry : path) {
        if (entry.empty())
            continue;
        if (entry == "@") {
            if (!last.empty())
                add_once(folders, last);
            continue;
        }
        add_once(folders, entry);
        if (fs::path(entry).is_relative() && scene_folder != ".")
            add_once(folders, (scene_folder / entry).lexically_normal().string());
    }
    add_once(folders, scene_folder.string());
    if (!last.empty())
        add_once(folders, last);
    return folders;
}

std::optional<std::string> find_file(const std::string& name, std::span<const std::string> folders,
                                     std::span<const char* const> extensions,
                                     const std::function<bool(const std::string&)>& serves) {
    if (name.empty() || name.find('\0') != std::string::npos)
        return std::nullopt;
    const bool absolute = fs::path(name).is_absolute();
    const std::string nowhere;
    for (const std::string& folder : absolute ? std::span(&nowhere, 1) : folders)
        for (const char* extension : extensions) {
            const fs::path candidate =
                (absolute ? fs::path(name) : fs::path(folder) / name).string() + extension;
            if (is_file(candidate) && (!serves || serves(candidate.string())))
                return candidate.string();
        }
    return std::nullopt;
}

std::string join_folders(std::span<const std::string> folders) {
    std::string all;
    for (const std::string& folder : folders)
        all += (all.empty() ? "\"" : ", \"") + folder + "\"";
    return all;
}

} // namespace kanuka::shade
