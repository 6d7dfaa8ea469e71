#include "shade/foreign.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "sl/sl.h"

namespace kanuka::shade {

static std::string first_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 64> head{};
    file.read(head.data(), head.size());
    return {head.data(), size_t(file.gcount())};
}

bool is_published_shader(const std::string& path) {
    return sl::is_slo(first_bytes(path));
}

std::string foreign_picture(const std::string& path) {
    const std::string head = first_bytes(path), suffix = std::filesystem::path(path).extension().string();
    if (head.starts_with("Aqsis ZFile"))
        return "is a depth file for shadow maps; shadows are traced and need none";
    if (head.starts_with("Ptex"))
        return "is a Ptex file, which is not read; bake it to a TIFF or EXR file by texture coordinates";
    for (const std::string_view made :
         {".tex", ".tx", ".txr", ".tdl", ".env", ".cubeenv", ".shd", ".shad", ".ptc", ".bkm", ".dtex"})
        if (suffix == made)
            return "is in a format that only the renderer reads that made it; make it again of its picture, "
                   "by "
                   "MakeTexture and its kin or kanuka texture, or name the picture itself";
    return "is no picture that can be read; write it anew, as a TIFF, EXR, PNG or JPEG file";
}

} // namespace kanuka::shade
