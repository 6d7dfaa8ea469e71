// Which co-shaders a shader reaches, and by which of its parameters.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "sl/sl.h"

namespace kanuka::shade {

struct CoShader {
    const scene::ShaderRef* ref = nullptr;
    std::shared_ptr<const sl::Shader> shader; // compiled by itself: its parameters are known from it
    std::string path;
    std::string handle; // of one that another brought along: that one's and its own, "outer/inner"
    std::string category;
    std::vector<sl::Connection> connections;
    bool layer = false; // of a shader of several (scene/layers.h)
};

struct Network {
    std::vector<CoShader> coshaders;         // in the order in which they were declared
    std::vector<sl::Connection> connections; // of the shader itself
};

// Null: reported.
using LoadCoShader = std::function<std::optional<CoShader>(const scene::ShaderRef&)>;

// `scope`: lists of co-shaders, the nearest first. A shader that asks for co-shaders by name or category
// reaches all of them, any other those that its parameters name, and what these reach. Handles of what is not
// there are reported; so are circles, which are cut where they close.
Network connect_coshaders(const sl::Shader& shader, const scene::ShaderRef& ref,
                          const std::vector<const std::vector<scene::ShaderRef>*>& scope,
                          const LoadCoShader& load, Journal& journal);

// Adds them to the options. Returns what tells networks apart.
std::string describe(const Network& network, sl::CompileOptions& options);

} // namespace kanuka::shade
