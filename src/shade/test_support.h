// Helpers of the unit tests here: a shader without a compiler, folders that go away, values in one line.
#pragma once

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <unistd.h>

#include "scene/test_values.h"
#include "sl/sl.h"

namespace kanuka::shade::test {

struct TemporaryFolder {
    std::filesystem::path path;
    TemporaryFolder() {
        static int count = 0;
        path = std::filesystem::temp_directory_path() /
               ("kanuka_shade_" + std::to_string(::getpid()) + "_" + std::to_string(count++));
        std::filesystem::create_directories(path);
    }
    ~TemporaryFolder() { std::filesystem::remove_all(path); }
    std::string write(const std::string& name, const std::string& text) const {
        std::filesystem::create_directories((path / name).parent_path());
        std::ofstream(path / name) << text;
        return (path / name).string();
    }
    std::string str() const { return path.string(); }
};

// A texture lookup at some points, and what it gave.
struct Lookup {
    std::vector<float> s, t, zero, step;
    std::vector<float> result;
    sl::TextureRequest request{};

    Lookup(const std::string& file, std::vector<float> s_in, std::vector<float> t_in, float footprint = 0,
           int channels = 3)
        : s(std::move(s_in)), t(std::move(t_in)), zero(s.size(), 0.0f), step(s.size(), footprint),
          result(s.size() * size_t(channels), -1.0f), name(file) {
        request.file = name.c_str();
        request.s = s.data(), request.t = t.data();
        request.dsdu = step.data(), request.dtdu = zero.data();
        request.dsdv = zero.data(), request.dtdv = step.data();
        request.count = int(s.size());
        request.channels = channels;
        request.width = 1;
        request.result = result.data();
        request.result_stride = int(s.size());
    }

  private:
    std::string name;
};

inline scene::Value value(std::string name, scene::Type type, std::vector<float> floats,
                          scene::Detail detail = scene::Detail::Uniform) {
    return scene::testing::value(std::move(name), type, detail, std::move(floats));
}

inline scene::Value text(std::string name, std::string string) {
    scene::Value v;
    v.name = std::move(name);
    v.type = scene::Type::String;
    v.strings = std::vector<std::string>{std::move(string)};
    return v;
}

inline sl::Parameter parameter(std::string name, sl::Type type, int array_size = 0) {
    sl::Parameter p;
    p.name = std::move(name);
    p.type = type;
    p.array_size = array_size;
    return p;
}

// One Lambert lobe of colour Cs, and a place for every argument it was given.
class FakeShader final : public sl::Shader, public std::enable_shared_from_this<FakeShader> {
  public:
    FakeShader(std::string name, sl::ShaderKind kind, std::vector<sl::Parameter> parameters)
        : m_name(std::move(name)), m_kind(kind), m_parameters(std::move(parameters)) {}
    const std::string& name() const override { return m_name; }
    sl::ShaderKind kind() const override { return m_kind; }
    std::span<const sl::Parameter> parameters() const override { return m_parameters; }
    uint64_t hash() const override { return std::hash<std::string>()(m_name); }
    bool from_cache() const override { return false; }
    std::unique_ptr<sl::Instance> instantiate(std::span<const sl::Argument> arguments,
                                              sl::Services& services) const override;

    std::string init_asks_for; // a space that mnk_init transforms to
    mutable int instances = 0; // how often it was instantiated
    mutable std::vector<sl::Argument> last_arguments;
    mutable sl::GridGlobals last_globals;
    mutable float last_shader_to_current[16] = {};

  private:
    std::string m_name;
    sl::ShaderKind m_kind;
    std::vector<sl::Parameter> m_parameters;
};

class FakeInstance final : public sl::Instance {
  public:
    explicit FakeInstance(const FakeShader& shader) : m_shader(shader) {
        grid::LayerNode leaf;
        leaf.inputs = {0};
        m_program.nodes = {leaf};
        m_program.slots = {
            {grid::InputType::Color, grid::Storage::Color, 0, 1, true, "diffuse.diffuseReflectance"}};
    }
    const sl::Shader& shader() const override { return m_shader; }
    const grid::LayeringProgram& program() const override { return m_program; }
    bool displaces() const override { return m_shader.kind() == sl::ShaderKind::Displacement; }
    void displace(grid::Grid& grid, const sl::GridGlobals& globals, sl::Services& services) const override {
        m_shader.last_globals = globals;
        services.transform("shader", "current", m_shader.last_shader_to_current);
        for (int i = 0; i < grid.vertices(); i++)
            grid.P[size_t(2 * grid.stride + i)] += 1;
    }
    bool uniform_material() const override { return true; }
    bool uniform_material(bool) const override { return true; }
    bool emission_varies(bool) const override { return false; }
    void shade(grid::Grid& grid, const sl::GridGlobals& globals, sl::Services& services,
               grid::VertexInputs& out) const override {
        m_shader.last_globals = globals;
        services.transform("shader", "current", m_shader.last_shader_to_current);
        out.stride = grid.stride;
        out.slots.resize(1);
        out.slots[0].uniform = true;
        out.slots[0].value = globals.Cs;
    }

  private:
    const FakeShader& m_shader;
    grid::LayeringProgram m_program;
};

inline std::unique_ptr<sl::Instance> FakeShader::instantiate(std::span<const sl::Argument> arguments,
                                                             sl::Services& services) const {
    instances++;
    last_arguments.assign(arguments.begin(), arguments.end());
    float matrix[16];
    if (!init_asks_for.empty())
        services.transform("current", init_asks_for.c_str(), matrix);
    return std::make_unique<FakeInstance>(*this);
}

} // namespace kanuka::shade::test
