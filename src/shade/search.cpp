#include "shade/search.h"

#include <algorithm>
#include <filesystem>

#include "sl/parse/source.h"

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

std::string searched_in(std::span<const std::string> folders, const std::string& kind,
                        const Location& asker) {
    return "searched in " + join_folders(folders) + ". Add its folder: " +
           (asker.file.empty() ? "scene.options." + kind + "_path"
                               : "Option \"searchpath\" \"" + kind + "\" [\"FOLDER\"]");
}

std::string did_you_mean(const std::string& name, std::span<const std::string> folders,
                         std::span<const char* const> extensions) {
    std::vector<std::string> there;
    for (const std::string& folder : folders) {
        std::error_code failed;
        for (fs::directory_iterator file(folder, failed), end; !failed && file != end; file.increment(failed))
            for (const char* extension : extensions) {
                const std::string found = file->path().filename().string();
                if (found.ends_with(extension))
                    there.push_back(found.substr(0, found.size() - std::string_view(extension).size()));
            }
    }
    std::sort(there.begin(), there.end()); // folders list their files in any order
    const std::string near = sl::closest(name, {there.begin(), there.end()});
    return near.empty() || near == name ? "" : "; did you mean \"" + near + "\"?";
}

} // namespace kanuka::shade
