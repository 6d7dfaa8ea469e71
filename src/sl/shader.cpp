#include "sl/shader.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/cache_folder.h"
#include "sl/codegen/cache.h"
#include "sl/frontend.h"
#include "sl/summary.h"

namespace kanuka::sl {

int components(Type type) {
    return type == Type::Float || type >= Type::String ? 1 : type == Type::Matrix ? 16 : 3;
}

std::string_view type_name(Type type) {
    static constexpr std::string_view Names[] = {"float",  "color",  "point",  "vector",
                                                 "normal", "matrix", "string", "shader"};
    return Names[int(type)];
}

std::string_view kind_name(ShaderKind kind) {
    static constexpr std::string_view Names[] = {"class", "surface", "displacement",
                                                 "light", "volume",  "imager"};
    return Names[int(kind)];
}

std::string default_cache_dir() {
    return cache_folder("KANUKA_SHADER_CACHE", "shaders");
}

// ---- compiling
// ------------------------------------------------------------------------------------------------------

static std::optional<std::string> read_text(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::error_code ec;
    if (!in || std::filesystem::is_directory(path, ec))
        return std::nullopt;
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

std::shared_ptr<const Shader> compile_source(const std::string& name, const std::string& source,
                                             const CompileOptions& given, Journal& journal) {
    CompileOptions options = given;
    for (CoShader& c : options.coshaders)
        if (c.text.empty()) {
            const std::optional<std::string> text = read_text(c.file);
            if (!text) {
                journal.error({c.file}, "cannot read co-shader \"" + c.handle + "\"");
                return nullptr;
            }
            c.text = *text;
        }
    try {
        return ShaderImpl::make(std::make_unique<ShaderSource>(name, source, options), options, journal);
    } catch (const Error& e) {
        journal.error(e.where().file.empty() ? Location{name} : e.where(), e.what());
        return nullptr;
    }
}

std::shared_ptr<const Shader> compile_file(const std::string& path, const CompileOptions& options,
                                           Journal& journal) {
    const std::optional<std::string> text = read_text(path);
    if (!text) {
        journal.error({path}, "cannot read the shader");
        return nullptr;
    }
    return compile_source(path, *text, options, journal);
}

// ---- shaders
// ----------------------------------------------------------------------------------------------------------

int usable_lanes(int lanes) {
    return std::min(lanes == 1 || lanes == 8 || lanes == 16 ? lanes : widest_lanes(), widest_lanes());
}

ShaderSource::ShaderSource(std::string name, std::string text, CompileOptions options)
    : m_name(std::move(name)), m_text(std::move(text)), m_options(std::move(options)) {
    if (!is_slo(m_text))
        m_file = m_name;
}

ShaderSource::~ShaderSource() = default;

FrontEnd& ShaderSource::front() {
    if (!m_front)
        m_front = std::make_unique<FrontEnd>(m_name, m_text, m_options, m_journal);
    return *m_front;
}

static std::string hash_text(std::string_view s) {
    char text[40];
    std::snprintf(text, sizeof text, "%016llx%016llx",
                  static_cast<unsigned long long>(hash_bytes(s.data(), s.size(), 3)),
                  static_cast<unsigned long long>(hash_bytes(s.data(), s.size(), 4)));
    return text;
}

// A text that includes nothing is named by itself; else all files must be read. Either way the key has what
// comments and names of files say, since parameters' documentation and messages are kept with the code.
const std::string& ShaderSource::identity() {
    if (!m_identity.empty())
        return m_identity;
    std::string all = m_options.strict_directions ? "strict\n" : "";
    if (m_options.array_room != CompileOptions{}.array_room)
        all += "room " + std::to_string(m_options.array_room) + "\n";
    if (m_options.rispec_specular)
        all += "rispec specular\n";
    if (m_options.gathers_light)
        all += "gathers light\n";
    if (m_options.area_light)
        all += "area light\n";
    for (const std::string& aov : m_options.aovs)
        all += "aov " + aov + "\n";
    for (const auto& [name, value] : m_options.defines)
        all += name + "=" + value + "\n";
    const auto connect = [&](const std::vector<Connection>& connections) {
        for (const Connection& c : connections) {
            all += "connect " + c.parameter;
            for (const std::string& handle : c.handles)
                all += "\n  " + handle;
            all += (c.output.empty() ? "" : "\n  its " + c.output) + "\n";
        }
    };
    connect(m_options.connections);
    const char* kind = "text ";
    const auto add = [&](const std::string& name, const std::string& text) {
        if (is_slo(text)) {
            std::string problem;
            if (!read_slo(text, problem, true))
                throw Error({name}, problem);
            kind = kind[0] == 't' ? "published " : kind;
        } else if (text.find("include") != std::string::npos || text.find("__FILE__") != std::string::npos) {
            kind = "files ";
        }
        all += text;
    };
    add(m_name, m_text);
    for (const CoShader& c : m_options.coshaders) {
        all += (c.layer ? "\nlayer " : "\nco-shader ") + c.handle + "\n" + c.category + "\n" + c.file + "\n";
        connect(c.connections);
        add(c.file, c.text);
    }
    if (kind[0] == 'f') {
        Sources& sources = front().sources();
        for (uint32_t f = 1; f < sources.count(); f++)
            all += "\n" + sources.name(f) + "\n" + std::string(sources.text(f));
        if (m_text.find("__FILE__") != std::string::npos)
            all += m_name;
    }
    return m_identity = kind + hash_text(all);
}

const ir::Program* ShaderSource::program() {
    if (!m_tried) {
        m_tried = true;
        if (std::optional<ir::Program> program = front().lower())
            m_program = std::make_unique<ir::Program>(std::move(*program));
        m_front.reset(); // tree and tokens are needed no more
    }
    return m_program.get();
}

static void forward(const std::vector<Journal::Entry>& messages, Journal& journal) {
    for (const Journal::Entry& e : messages)
        for (uint64_t n = 0; n < e.count; n++)
            journal.report(e.severity, e.where, e.message);
}

ShaderImpl::ShaderImpl(std::unique_ptr<ShaderSource> source, CompileOptions options)
    : m_options(std::move(options)), m_source(std::move(source)) {
    m_options.lanes = usable_lanes(m_options.lanes);
    if (m_options.cache_dir.empty())
        m_options.cache_dir = default_cache_dir();
}

std::shared_ptr<ShaderImpl> ShaderImpl::make(std::unique_ptr<ShaderSource> source, CompileOptions options,
                                             Journal& journal) {
    std::shared_ptr<ShaderImpl> shader(new ShaderImpl(std::move(source), std::move(options)));
    const std::lock_guard lock(shader->m_mutex);
    auto build = std::make_unique<Build>();
    Summary summary;
    if (shader->load(*build, true, summary)) {
        forward(summary.messages, journal);
        shader->m_program = std::make_shared<const ir::Program>(std::move(summary.program));
        shader->m_from_cache = true;
    } else {
        const ir::Program* program = shader->m_source->program();
        forward(shader->m_source->messages(), journal);
        if (!program)
            return nullptr;
        // The source owns it, and lives as long as the shader.
        shader->m_program = std::shared_ptr<const ir::Program>(std::shared_ptr<void>(), program);
        build = std::make_unique<Build>();
        shader->compile(*build, true, &journal);
    }
    shader->m_builds[ir::Variant{}.key()] = std::move(build);
    std::string key = shader->m_program->name + "|" + std::to_string(shader->m_options.opt_level) + "|" +
                      std::to_string(CompilerVersion);
    for (const std::string& aov : shader->m_program->aovs)
        key += "|" + aov;
    shader->m_hash = hash_bytes(key.data(), key.size(), shader->m_program->source_hash);
    return shader;
}

void prepare(BuiltStage& built, const ir::Stage& stage, const ir::Variant& variant, const std::string& symbol,
             int lanes, std::vector<StageToCompile>& list) {
    if (!stage.root)
        return;
    built.stage = stage;
    ir::infer_detail(built.stage, variant, nullptr);
    ir::make_masks(built.stage);
    built.plan = ir::make_plan(built.stage);
    list.push_back({symbol, &built.stage, &built.plan, lanes});
}

std::string ShaderImpl::cache_key(const std::string& variant, bool first) const {
    const std::string file = std::filesystem::path(m_source->name()).stem().string();
    return "shader " + file + ", lanes " + std::to_string(m_options.lanes) + ", O" +
           std::to_string(m_options.opt_level) + ", variant " + variant + (first ? " with init" : "") +
           ", source " + m_source->identity() + ", compiler " + std::to_string(CompilerVersion) + "." +
           std::to_string(SummaryVersion) + ", LLVM " + backend_version();
}

static void find_functions(Build& build) {
    static constexpr const char* Symbols[] = {"kanuka_defaults", "kanuka_init",  "kanuka_interior",
                                              "kanuka_displace", "kanuka_shade", "kanuka_light",
                                              "kanuka_filter"};
    const auto stages = build.stages();
    for (size_t k = 0; k < stages.size(); k++)
        if (stages[k]->stage.root)
            stages[k]->run = build.code->find(Symbols[k]);
}

// From the cache; false if it is not there, or not whole.
bool ShaderImpl::load(Build& build, bool first, Summary& summary) const {
    if (!m_options.use_cache)
        return false;
    const ObjectCache cache(m_options.cache_dir);
    const std::optional<std::string> entry = cache.read(cache_key(build.variant.key(), first));
    std::string_view object;
    if (!entry || !unpack_entry(*entry, first, m_source->file(), summary, object))
        return false;
    try {
        summary.build.code = link_object(object);
        find_functions(summary.build);
    } catch (const Error&) {
        return false; // whole, and yet no code: made by another compiler that says it is this one
    }
    summary.build.variant = build.variant;
    summary.build.from_cache = true;
    build = std::move(summary.build);
    ir::Variant v = build.variant;
    for (int k = 0; k < 4; k++) {
        v.Cs = k & 1;
        v.Os = k & 2;
        m_uniform[v.key()] = summary.uniform[k];
    }
    return true;
}

static std::vector<bool> find_uniform(const ir::Program& program, const ir::Variant& variant) {
    ir::Stage stage = program.shade;
    if (stage.root)
        ir::infer_detail(stage, variant, nullptr);
    std::vector<bool> uniform;
    for (const ir::Output& o : stage.outputs)
        uniform.push_back(o.var >= 0 && !stage.vars[size_t(o.var)].varying);
    return uniform;
}

void ShaderImpl::compile(Build& build, bool first, Journal* journal) const {
    const ir::Program* program = m_source->program();
    if (!program)
        throw Error({m_source->name()},
                    "the shader's files have changed since it was first read, and no longer compile");
    std::vector<StageToCompile> list;
    if (first) { // what runs once an instance is compiled once
        prepare(build.defaults, program->defaults, build.variant, "kanuka_defaults", 1, list);
        prepare(build.init, program->init, build.variant, "kanuka_init", 1, list);
        prepare(build.interior, program->interior, build.variant, "kanuka_interior", 1, list);
    }
    prepare(build.displace, program->displace, build.variant, "kanuka_displace", m_options.lanes, list);
    prepare(build.shade, program->shade, build.variant, "kanuka_shade", m_options.lanes, list);
    prepare(build.light, program->light, build.variant, "kanuka_light", m_options.lanes, list);
    prepare(build.filter, program->filter, build.variant, "kanuka_filter", m_options.lanes, list);
    const std::string object = compile_object(*program, list, m_options.lanes, m_options.opt_level);
    build.code = link_object(object);
    find_functions(build);
    if (!m_options.use_cache)
        return;
    std::vector<bool> uniform[4];
    ir::Variant v = build.variant;
    for (int k = 0; k < 4; k++) {
        v.Cs = k & 1;
        v.Os = k & 2;
        uniform[k] = m_uniform[v.key()] = find_uniform(*program, v);
    }
    const ObjectCache cache(m_options.cache_dir);
    const std::string problem = cache.write(
        cache_key(build.variant.key(), first),
        pack_entry(*program, m_source->messages(), build, uniform, first, m_source->file(), object));
    if (journal && !problem.empty())
        journal->warning({}, problem);
}

const Build& ShaderImpl::build(const ir::Variant& variant) const {
    const std::lock_guard lock(m_mutex);
    std::unique_ptr<Build>& slot = m_builds[variant.key()];
    if (!slot) {
        auto b = std::make_unique<Build>();
        b->variant = variant;
        Summary summary;
        if (!load(*b, false, summary))
            compile(*b, false, nullptr);
        slot = std::move(b);
    }
    return *slot;
}

std::vector<std::string> ShaderImpl::stages() const {
    std::vector<std::string> names;
    for (const ir::Stage* s : m_program->stages())
        if (s->root && s != &m_program->defaults)
            names.push_back(s->name);
    return names;
}

std::vector<bool> ShaderImpl::uniform_outputs(const ir::Variant& variant) const {
    const std::lock_guard lock(m_mutex);
    const std::string key = variant.key();
    if (const auto known = m_uniform.find(key); known != m_uniform.end())
        return known->second;
    if (m_from_cache) { // an entry knows it for itself, with and without Cs and Os
        auto b = std::make_unique<Build>();
        b->variant = variant;
        b->variant.Cs = b->variant.Os = false;
        Summary summary;
        if (std::unique_ptr<Build>& slot = m_builds[b->variant.key()]; !slot && load(*b, false, summary))
            slot = std::move(b);
        if (const auto known = m_uniform.find(key); known != m_uniform.end())
            return known->second;
    }
    const ir::Program* program = m_source->program();
    if (!program)
        return std::vector<bool>(m_program->shade.outputs.size(), false);
    return m_uniform[key] = find_uniform(*program, variant);
}

std::unique_ptr<Instance> ShaderImpl::instantiate(std::span<const Argument> arguments,
                                                  Services& services) const {
    return std::make_unique<InstanceImpl>(shared_from_this(), arguments, services);
}

} // namespace kanuka::sl
