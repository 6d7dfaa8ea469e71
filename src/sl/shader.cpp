#include "sl/shader.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "sl/codegen/cache.h"
#include "sl/ir/lower.h"
#include "sl/parse/parser.h"

namespace kanuka::sl {

int components(Type type) {
    return type == Type::Float || type == Type::String ? 1 : type == Type::Matrix ? 16 : 3;
}

std::string default_cache_dir() {
    if (const char* dir = std::getenv("KANUKA_SHADER_CACHE"); dir && *dir)
        return dir;
    if (const char* dir = std::getenv("XDG_CACHE_HOME"); dir && *dir)
        return std::string(dir) + "/kanuka/shaders";
    const char* home = std::getenv("HOME");
    return std::string(home && *home ? home : "/tmp") + "/.cache/kanuka/shaders";
}

// ---- front end
// ------------------------------------------------------------------------------------------------------

// "#pragma annotation name "text"" documents a parameter.
static void annotate(const std::vector<Pragma>& pragmas, std::vector<Parameter>& parameters) {
    for (const Pragma& p : pragmas) {
        if (p.tokens.size() < 3 || !p.tokens[0].is("annotation"))
            continue;
        for (Parameter& parameter : parameters)
            if (p.tokens[1].text == parameter.name && p.tokens[2].kind == Token::String)
                parameter.doc = p.tokens[2].text;
    }
}

static ir::Variant all_varying(const ir::Program& program) {
    ir::Variant v;
    v.Cs = v.Os = true;
    for (const ir::Place& p : program.places)
        v.params.push_back(p.varying);
    return v;
}

// Source to IR; reports to the diagnostics.
static std::optional<ir::Program> front_end(const std::string& name, std::string text,
                                            const CompileOptions& options, Journal& journal) {
    Sources sources;
    Diagnostics diagnostics(sources, journal);
    const uint32_t file = sources.add(name, std::move(text));
    const Preprocessed source = preprocess(sources, file, options.include_path, options.defines, diagnostics);
    ast::Arena arena;
    ast::Unit unit = Parser(source.tokens, arena, diagnostics).unit();
    if (unit.shaders.empty()) {
        if (diagnostics.errors() == 0)
            diagnostics.error(
                source.tokens.back().loc,
                "the file has no shader; expected surface, displacement, light, volume, imager or class");
        return std::nullopt;
    }
    Sema sema(arena, diagnostics);
    sema.check(unit, *unit.shaders[0]);
    if (diagnostics.errors() > 0)
        return std::nullopt;
    // Illuminance loops are read as lobes; those that turn out to be none are projected in the next round.
    ir::Program program;
    std::map<int, Loc> projected;
    for (bool again = true; again;) {
        program = {};
        program.aovs = options.aovs;
        ir::Lower(program, sema, diagnostics, *unit.shaders[0], projected).run();
        if (diagnostics.errors() > 0)
            return std::nullopt;
        std::map<int, Loc> failed = ir::extract_closures(program, diagnostics, options.strict_directions);
        if (diagnostics.errors() > 0)
            return std::nullopt;
        for (const auto& [number, at] : failed)
            if (options.strict_directions)
                diagnostics.error(at,
                                  "this kernel of an illuminance loop is not that of a lobe. Known are Cl "
                                  "times N . L, pow(N . H, n), pow(R . L, n) and specularbrdf()");
        if (diagnostics.errors() > 0)
            return std::nullopt;
        const size_t before = projected.size();
        projected.merge(failed);
        again = projected.size() > before;
    }
    for (ir::Stage* s :
         {&program.defaults, &program.init, &program.interior, &program.displace, &program.shade}) {
        ir::simplify(*s);
        if (!s->root)
            continue;
        ir::number_texts(*s, all_varying(program), diagnostics);
        ir::Stage checked = *s;
        ir::infer_detail(checked, all_varying(program), &diagnostics);
        if (s == &program.shade)
            ir::check_directions(program, program.Ci >= 0 && !options.strict_directions, diagnostics);
    }
    if (diagnostics.errors() > 0)
        return std::nullopt;
    annotate(source.pragmas, program.parameters);
    program.source_hash = source.hash;
    for (uint32_t f = 0; f < 1 || f <= file; f++)
        program.files.push_back(sources.name(f));
    // Included files come after the main one; shadeops' own sources too, under their name.
    for (const auto& stage : {&program.init, &program.interior, &program.displace, &program.shade})
        for (const ir::Instr& i : stage->instrs)
            while (program.files.size() <= i.loc.file)
                program.files.push_back(sources.name(uint32_t(program.files.size())));
    return program;
}

std::shared_ptr<const Shader> compile_source(const std::string& name, const std::string& source,
                                             const CompileOptions& options, Journal& journal) {
    try {
        std::optional<ir::Program> program = front_end(name, source, options, journal);
        if (!program)
            return nullptr;
        return std::make_shared<ShaderImpl>(std::move(*program), options);
    } catch (const Error& e) {
        journal.error({name}, e.what());
        return nullptr;
    }
}

std::shared_ptr<const Shader> compile_file(const std::string& path, const CompileOptions& options,
                                           Journal& journal) {
    std::ifstream in(path, std::ios::binary);
    std::error_code ec;
    if (!in || std::filesystem::is_directory(path, ec)) {
        journal.error({path}, "cannot read the shader");
        return nullptr;
    }
    std::ostringstream text;
    text << in.rdbuf();
    return compile_source(path, text.str(), options, journal);
}

// ---- shaders
// ----------------------------------------------------------------------------------------------------------

ShaderImpl::ShaderImpl(ir::Program program, CompileOptions options)
    : m_program(std::move(program)), m_options(std::move(options)) {
    const int widest = widest_lanes();
    if (m_options.lanes != 1 && m_options.lanes != 8 && m_options.lanes != 16)
        m_options.lanes = widest;
    m_options.lanes = std::min(m_options.lanes, widest);
    std::string key =
        m_program.name + "|" + std::to_string(m_options.opt_level) + "|" + std::to_string(CompilerVersion);
    for (const std::string& aov : m_program.aovs)
        key += "|" + aov;
    m_hash = hash_bytes(key.data(), key.size(), m_program.source_hash);
    for (const ir::Stage* s : {&m_program.displace, &m_program.shade})
        for (const ir::CallSite& c : s->calls)
            m_queries = m_queries || c.kind == ir::CallKind::Found;
    m_from_cache = build({}).from_cache;
}

static void prepare(BuiltStage& built, const ir::Stage& stage, const ir::Variant& variant,
                    const std::string& symbol, int lanes, std::vector<StageToCompile>& list) {
    if (!stage.root)
        return;
    built.stage = stage;
    ir::infer_detail(built.stage, variant, nullptr);
    ir::make_masks(built.stage);
    built.plan = ir::make_plan(built.stage);
    list.push_back({symbol, &built.stage, &built.plan, lanes});
}

const Build& ShaderImpl::build(const ir::Variant& variant) const {
    const std::string key = variant.key();
    const std::lock_guard lock(m_mutex);
    std::unique_ptr<Build>& slot = m_builds[key];
    if (slot)
        return *slot;
    auto b = std::make_unique<Build>();
    b->variant = variant;
    std::vector<StageToCompile> list;
    const bool first = m_builds.size() == 1; // what runs once an instance is compiled once
    if (first) {
        prepare(b->defaults, m_program.defaults, variant, "kanuka_defaults", 1, list);
        prepare(b->init, m_program.init, variant, "kanuka_init", 1, list);
        prepare(b->interior, m_program.interior, variant, "kanuka_interior", 1, list);
    }
    prepare(b->displace, m_program.displace, variant, "kanuka_displace", m_options.lanes, list);
    prepare(b->shade, m_program.shade, variant, "kanuka_shade", m_options.lanes, list);
    std::string cache_key = "kanuka sl " + std::to_string(CompilerVersion) + " " + backend_version() +
                            " source " + std::to_string(m_program.source_hash) + " " + m_program.name +
                            " lanes " + std::to_string(m_options.lanes) + " O" +
                            std::to_string(m_options.opt_level) + " variant " + key +
                            (first ? " with init" : "");
    for (const std::string& aov : m_program.aovs)
        cache_key += " aov " + aov;
    const ObjectCache cache(m_options.cache_dir.empty() ? default_cache_dir() : m_options.cache_dir);
    std::optional<std::string> object;
    if (m_options.use_cache)
        object = cache.read(cache_key);
    b->from_cache = object.has_value();
    if (!object) {
        object = compile_object(m_program, list, m_options.lanes, m_options.opt_level);
        if (m_options.use_cache)
            cache.write(cache_key, *object);
    }
    b->code = link_object(*object, m_options.lanes);
    for (const auto& [stage, symbol] :
         {std::pair{&b->defaults, "kanuka_defaults"}, std::pair{&b->init, "kanuka_init"},
          std::pair{&b->interior, "kanuka_interior"}, std::pair{&b->displace, "kanuka_displace"},
          std::pair{&b->shade, "kanuka_shade"}})
        if (stage->stage.root)
            stage->run = b->code->find(symbol);
    slot = std::move(b);
    return *slot;
}

std::vector<bool> ShaderImpl::uniform_outputs(const ir::Variant& variant) const {
    ir::Stage stage = m_program.shade;
    ir::infer_detail(stage, variant, nullptr);
    std::vector<bool> uniform;
    for (const ir::Output& o : stage.outputs)
        uniform.push_back(o.var >= 0 && !stage.vars[size_t(o.var)].varying);
    return uniform;
}

std::unique_ptr<Instance> ShaderImpl::instantiate(std::span<const Argument> arguments,
                                                  Services& services) const {
    return std::make_unique<InstanceImpl>(shared_from_this(), arguments, services);
}

} // namespace kanuka::sl
