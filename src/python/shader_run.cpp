// Shading without a scene: a shader over the unit square.
#include <filesystem>

#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include "grid/word_layout.h"
#include "python/arguments.h"
#include "python/arrays.h"
#include "python/messages.h"
#include "python/shader.h"
#include "shade/services.h"
#include "shade/textures.h"

namespace kanuka::python {

namespace {

// (height x width) vertices of z = 0: P = (u, v, 0), N = +z, s = u, t = v; row 0 is v = 0.
grid::Grid unit_square(int width, int height) {
    grid::Grid g;
    g.allocate(width - 1, height - 1);
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const size_t k = size_t(j) * size_t(width) + size_t(i), n = size_t(g.stride);
            const float u = width > 1 ? float(i) / float(width - 1) : 0,
                        v = height > 1 ? float(j) / float(height - 1) : 0;
            g.u[k] = g.s[k] = g.P[k] = u;
            g.v[k] = g.t[k] = g.P[n + k] = v;
            g.N[2 * n + k] = g.Ng[2 * n + k] = 1;
            g.dPdu[k] = g.dPdv[n + k] = 1;
        }
    return g;
}

nb::object plane(const float* data, size_t stride, int components, int width, int height) {
    const size_t pixels = size_t(width) * size_t(height), count = size_t(components);
    auto out = std::make_unique<float[]>(pixels * count);
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < count; c++)
            out[i * count + c] = data[c * stride + i];
    float* raw = out.release();
    nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<float*>(p); });
    const size_t shape[] = {size_t(height), size_t(width), count};
    return nb::ndarray<nb::numpy, float>(raw, count == 1 ? 2 : 3, shape, owner).cast();
}

// Values by name: texts; numbers, one or several; arrays of the grid's size, which vary.
void bind(const nb::dict& values, const sl::Shader& shader, int width, int height, grid::Grid& grid,
          std::vector<sl::Argument>& arguments) {
    for (auto [key, value] : values) {
        sl::Argument a;
        a.name = nb::cast<std::string>(key);
        const sl::Parameter* parameter = nullptr;
        for (const sl::Parameter& p : shader.parameters())
            if (p.name == a.name)
                parameter = &p;
        if (nb::isinstance<nb::str>(value)) {
            a.strings.push_back(nb::cast<std::string>(value));
        } else if (parameter && parameter->type >= sl::Type::String) {
            a.strings = nb::cast<std::vector<std::string>>(value);
        } else {
            const FloatArray array = float_array(value, a.name.c_str());
            size_t count = 1;
            for (const size_t n : array.shape)
                count *= n;
            const size_t pixels = size_t(width) * size_t(height);
            a.varying = array.shape.size() >= 2 && array.shape[0] == size_t(height) &&
                        array.shape[1] == size_t(width) && (array.shape.size() == 2 || array.shape[2] <= 16);
            if (a.varying) {
                const size_t components = count / pixels;
                grid::Channel c;
                c.name = a.name;
                c.components = int(components);
                c.stride = grid.stride;
                c.data.assign(size_t(grid.stride) * components, 0.0f);
                for (size_t i = 0; i < pixels; i++)
                    for (size_t k = 0; k < components; k++)
                        c.data[k * size_t(c.stride) + i] = array.buffer[i * components + k];
                grid.primvars.push_back(std::move(c));
            } else {
                for (size_t i = 0; i < count; i++)
                    a.floats.push_back(array.buffer[i]);
            }
        }
        arguments.push_back(std::move(a));
    }
}

nb::dict run(const ShaderInfo& info, int width, int height, const nb::dict& parameters,
             std::shared_ptr<Journal> given) {
    if (width < 1 || height < 1 || int64_t(width) * height > (int64_t(1) << 26))
        throw nb::value_error("expected a grid of 1 to 2^26 vertices");
    const Messages messages(std::move(given));
    const std::shared_ptr<Journal> journal = messages.journal;
    grid::Grid grid = unit_square(width, height);
    std::vector<sl::Argument> arguments;
    bind(parameters, *info.shader, width, height, grid, arguments);
    std::unique_ptr<sl::Instance> instance;
    grid::VertexInputs inputs;
    {
        nb::gil_scoped_release free;
        const std::filesystem::path folder = std::filesystem::path(info.file).parent_path();
        shade::Textures textures({folder.empty() ? "." : folder.string(), "."}, size_t(256) << 20, *journal);
        const shade::WorldSpaces world(scene::Scene{}, Transform{});
        const shade::Spaces spaces{&world, {}, {}, {}};
        const Location where{info.file};
        const shade::Facts facts;
        shade::MaterialServices services(spaces, facts, textures, *journal, where);
        sl::GridGlobals globals;
        globals.E = Vec3f(0.5f, 0.5f, 1);
        globals.du = width > 1 ? 1 / float(width - 1) : 0;
        globals.dv = height > 1 ? 1 / float(height - 1) : 0;
        instance = info.shader->instantiate(arguments, services);
        instance->displace(grid, globals, services);
        instance->shade(grid, globals, services, inputs);
    }
    nb::dict result, slots;
    const grid::LayeringProgram& program = instance->program();
    for (size_t s = 0; s < program.slots.size(); s++) {
        const grid::Slot& slot = program.slots[s];
        const int components = grid::components_of(slot.type);
        const grid::SlotValues& values = inputs.slots[s];
        std::vector<float> spread;
        if (values.uniform) {
            const size_t pixels = size_t(width) * size_t(height);
            for (int c = 0; c < components; c++)
                spread.insert(spread.end(), pixels, values.value[c]);
            slots[slot.name.c_str()] = plane(spread.data(), pixels, components, width, height);
        } else {
            slots[slot.name.c_str()] =
                plane(values.data.data(), size_t(inputs.stride), components, width, height);
        }
    }
    result["P"] = plane(grid.P.data(), size_t(grid.stride), 3, width, height);
    result["N"] = plane(grid.N.data(), size_t(grid.stride), 3, width, height);
    result["slots"] = slots;
    result["program"] = describe(program);
    messages.tell();
    return result;
}

} // namespace

nb::dict describe(const grid::LayeringProgram& program) {
    static constexpr const char* Ops[] = {"lobe", "mix", "over", "coat", "add", "thick"};
    nb::list nodes, slots;
    const auto slot_name = [&](int s) {
        return s < 0 ? nb::object(nb::none()) : nb::object(nb::cast(program.slots[size_t(s)].name));
    };
    for (const grid::LayerNode& n : program.nodes) {
        nb::dict node, inputs;
        const bool leaf = n.op == grid::LayerOp::Lobe;
        node["op"] = size_t(n.op) < std::size(Ops) ? Ops[size_t(n.op)] : "layer";
        node["name"] = n.name;
        node["weight"] = slot_name(n.weight);
        if (leaf) {
            const grid::LobeDecl& lobe = grid::lobe(n.lobe);
            node["lobe"] = std::string(lobe.name);
            for (size_t i = 0; i < lobe.inputs.size(); i++) {
                const grid::LobeInput& in = lobe.inputs[i];
                nb::dict input;
                input["slot"] = slot_name(n.inputs[i]);
                if (in.type != grid::InputType::Float)
                    input["default"] = nb::make_tuple(in.fallback.x, in.fallback.y, in.fallback.z);
                else
                    input["default"] = in.fallback.x;
                inputs[std::string(in.name).c_str()] = input;
            }
            node["inputs"] = inputs;
        } else {
            node["upper"] = n.upper;
            node["lower"] = n.lower;
        }
        nodes.append(node);
    }
    for (const grid::Slot& s : program.slots) {
        nb::dict slot;
        slot["name"] = s.name;
        static constexpr const char* Types[] = {"float", "color", "normal"};
        slot["type"] = Types[size_t(s.type)];
        slot["uniform"] = s.uniform;
        slots.append(slot);
    }
    // Words in which nothing varies are kept once a grid.
    const grid::WordLayout layout(program);
    size_t varying = 0;
    for (const auto& of_word : layout.slots_of_word)
        for (const int s : of_word)
            if (s >= 0 && !program.slots[size_t(s)].uniform) {
                varying++;
                break;
            }
    nb::dict result;
    result["nodes"] = nodes;
    result["slots"] = slots;
    result["presence"] = slot_name(program.presence);
    result["bytes_per_vertex"] = varying * 4;
    result["bytes_per_vertex_at_most"] = layout.words.size() * 4;
    if (program.interior) {
        nb::dict interior;
        const auto triple = [](const Rgb& c) { return nb::make_tuple(c.x, c.y, c.z); };
        interior["ior"] = program.interior->ior;
        interior["priority"] = program.interior->priority;
        interior["absorption"] = triple(program.interior->absorption);
        interior["scattering"] = triple(program.interior->scattering);
        const grid::LobeDecl& phase = grid::lobe(program.interior->phase);
        interior["phase"] = std::string(phase.name);
        for (size_t i = 0; i < phase.inputs.size(); i++)
            interior[std::string(phase.inputs[i].name).c_str()] = program.interior->phase_inputs[i];
        result["interior"] = interior;
    } else {
        result["interior"] = nb::none();
    }
    return result;
}

void bind_shader_run(nb::class_<ShaderInfo>& shader) {
    define(shader, "run", &run, nb::arg("width") = 1, nb::arg("height") = 1,
           nb::arg("parameters") = nb::dict(), nb::arg("journal") = nb::none(),
           "Shades the unit square, without a scene: `height` rows of `width` vertices with P = (u, v, "
           "0), N = +z, s = u,\n"
           "t = v; displacement first. Values of `parameters` that are arrays of that size vary. Returns "
           "\"P\" and \"N\",\n"
           "\"slots\" (the material's values by name, as arrays) and \"program\" (its lobes and layers).",
           nb::sig("def run(self, width: int = 1, height: int = 1, parameters: dict[str, object] = {}, "
                   "journal: Journal | None = None) -> dict[str, object]"));
}

} // namespace kanuka::python
