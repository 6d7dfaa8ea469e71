// A folder for published shaders and the cache, and shaders to put there.
#pragma once

#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "sl/test_support.h"

namespace kanuka::sl::test {

namespace fs = std::filesystem;

inline std::string read_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

class SlPublish : public testing::Test {
  protected:
    void SetUp() override {
        m_folder =
            fs::temp_directory_path() / ("kanuka_publish_" + std::to_string(getpid()) + "_" +
                                         testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(m_folder);
        fs::create_directories(m_folder);
    }
    void TearDown() override {
        std::error_code ec;
        fs::permissions(m_folder / "cache", fs::perms::owner_all, fs::perm_options::add, ec);
        fs::remove_all(m_folder);
    }
    std::string write(const std::string& name, const std::string& text) {
        std::ofstream(m_folder / name, std::ios::binary) << text;
        return (m_folder / name).string();
    }
    CompileOptions options() const {
        CompileOptions o;
        o.cache_dir = (m_folder / "cache").string();
        o.opt_level = 1;
        return o;
    }
    fs::path cache() const { return m_folder / "cache"; }
    fs::path m_folder;
};

inline const char* const Library = "float wobble(float x) {\n  return SCALE * sin(x);\n}\n";
inline const char* const Marble = R"(#include "lib.h"
#pragma annotation scale "waves across"
class marble(float scale = 3; color tint = color(0.5, 0.25, 1); /* of the veins */ string picture = "wood.tx";
             varying float wear = 0;) {
    float shared = 2;
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "skin", LambertBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        color c = tint * (0.5 + 0.25 * wobble(scale * u)) + 0.1 * color texture(picture, s, t) + wear;
        if (match("^x.*", picture) > 0) c = 0;
        SetLobe(b, "skin", 1, LambertBrdf("diffuseReflectance", c * shared * 0.25));
    }
})";

// Slots at all vertices, one after another.
inline std::vector<Vec3f> shade(const Shader& shader, std::span<const Argument> arguments = {},
                                grid::Grid g = plane(8, 5)) {
    TestServices services;
    const auto instance = shader.instantiate(arguments, services);
    grid::VertexInputs out;
    instance->shade(g, {}, services, out);
    std::vector<Vec3f> values;
    for (size_t s = 0; s < out.slots.size(); s++)
        for (int i = 0; i < g.vertices(); i++)
            values.push_back(value(out, int(s), i));
    return values;
}

} // namespace kanuka::sl::test
