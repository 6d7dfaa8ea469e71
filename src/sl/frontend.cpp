#include "sl/frontend.h"

#include "sl/codegen/cache.h"
#include "sl/deep_stack.h"
#include "sl/ir/lower.h"
#include "sl/ir/passes.h"
#include "sl/parse/parser.h"

namespace kanuka::sl {

FrontEnd::FrontEnd(const std::string& name, std::string text, const CompileOptions& options, Journal& journal)
    : m_diagnostics(m_sources, journal), m_strict(options.strict_directions), m_aovs(options.aovs),
      m_connections(options.connections), m_array_room(std::clamp(options.array_room, 1, 65536)),
      m_area_light(options.area_light), m_rispec_specular(options.rispec_specular),
      m_gathers_light(options.gathers_light) {
    m_source = read(name, std::move(text), options);
    for (const CoShader& c : options.coshaders) {
        Unit& unit = m_units.emplace_back();
        unit.given = c;
        unit.source = read(c.file, c.text, options);
        for (const Connection& connection : c.connections)
            m_connections.push_back(
                {c.handle + "." + connection.parameter, connection.handles, connection.output});
    }
}

Preprocessed FrontEnd::read(const std::string& name, std::string text, const CompileOptions& options) {
    Preprocessed source;
    if (is_slo(text)) {
        std::string problem;
        if (std::optional<Published> published = read_slo(text, problem); published && problem.empty())
            source = unpack(*published, m_sources, problem);
        if (!problem.empty())
            throw Error({name}, problem);
        return source;
    }
    const uint32_t file = m_sources.add(name, std::move(text));
    run_deep(
        [&] { source = preprocess(m_sources, file, options.include_path, options.defines, m_diagnostics); });
    return source;
}

bool FrontEnd::check() {
    if (!m_sema)
        run_deep([this] { parse_and_check(); });
    return m_sema && ok();
}

void FrontEnd::parse_and_check() {
    m_unit = Parser(m_source.tokens, m_arena, m_diagnostics).unit();
    if (m_unit.shaders.empty()) {
        if (ok())
            m_diagnostics.error(
                m_source.tokens.back().loc,
                "the file has no shader; expected surface, displacement, light, volume, imager or class");
        return;
    }
    if (!m_units.empty()) {
        link();
        if (!ok())
            return;
    }
    m_sema.emplace(m_arena, m_diagnostics, m_units.empty() ? nullptr : &m_linked);
    m_linked.caller = &*m_sema;
    for (Unit& unit : m_units)
        unit.sema->check(unit.tree, *unit.tree.shaders[0]);
    m_sema->check(m_unit, *m_unit.shaders[0]);
}

// A shader of another kind than class is a class with one method (RSL 2.0): surface(output color Ci, Oi).
static void make_method(ast::ShaderDecl& shader, ast::Arena& arena) {
    if (shader.kind == ShaderKind::Class || !shader.body)
        return;
    const bool displaces = shader.kind == ShaderKind::Displacement;
    ast::FunctionDecl* f = arena.function();
    f->name = kind_name(shader.kind);
    f->loc = shader.loc;
    f->result = {ast::Base::Void};
    f->is_public = true;
    f->body = std::exchange(shader.body, nullptr);
    for (const auto& [name, type] :
         {std::pair(displaces ? "P" : "Ci", displaces ? ast::Base::Point : ast::Base::Color),
          std::pair(displaces ? "N" : "Oi", displaces ? ast::Base::Normal : ast::Base::Color)}) {
        ast::VarDecl* v = arena.var();
        v->name = name;
        v->loc = shader.loc;
        v->kind = ast::VarDecl::Formal;
        v->type = {type};
        v->output = true;
        f->formals.push_back(v);
    }
    shader.functions.push_back(f);
    shader.kind = ShaderKind::Class;
}

// All are parsed before any is checked, since they call each other.
void FrontEnd::link() {
    for (Unit& unit : m_units) {
        unit.tree = Parser(unit.source.tokens, m_arena, m_diagnostics).unit();
        if (unit.tree.shaders.empty()) {
            if (ok())
                m_diagnostics.error(unit.source.tokens.back().loc,
                                    "the file of this co-shader has no shader");
            return;
        }
        make_method(*unit.tree.shaders[0], m_arena);
        m_linked.units.push_back({&unit.given, unit.tree.shaders[0]});
        unit.sema.emplace(m_arena, m_diagnostics, &m_linked);
    }
}

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

ir::Variant all_varying(const ir::Program& program) {
    ir::Variant v;
    v.Cs = v.Os = true;
    for (const ir::Place& p : program.places)
        v.params.push_back(p.varying);
    return v;
}

// The pictures that a shader asks for: by a name of its own, or by a parameter. Others are made while it
// runs.
static void find_textures(ir::Program& program) {
    for (ir::Stage* s : program.stages())
        for (const ir::Instr& i : s->instrs) {
            if (i.op != ir::Op::Call)
                continue;
            const ir::CallSite& site = s->calls[size_t(i.imm)];
            if (site.kind != ir::CallKind::Texture && site.kind != ir::CallKind::Environment)
                continue;
            const ir::Instr& name = s->instrs[size_t(site.args[0])];
            TextureUse use;
            use.environment = site.kind == ir::CallKind::Environment;
            if (name.op == ir::Op::Text)
                use.file = name.text;
            else if (name.op == ir::Op::Param)
                use.parameter = program.parameters[size_t(name.imm)].name;
            if (std::find(program.textures.begin(), program.textures.end(), use) == program.textures.end())
                program.textures.push_back(use);
        }
}

std::optional<ir::Program> FrontEnd::lower() {
    std::optional<ir::Program> program;
    if (ok())
        run_deep([&] { program = check_and_lower(); });
    return program;
}

std::optional<ir::Program> FrontEnd::check_and_lower() {
    if (!check())
        return std::nullopt;
    // Illuminance loops are read as lobes; those that turn out to be none are projected in the next round.
    ir::Program program;
    ir::LowerOptions options;
    options.connections = m_connections;
    options.array_room = m_array_room;
    for (bool again = true; again;) {
        program = {};
        program.aovs = m_aovs;
        program.area_light = m_area_light;
        program.rispec_specular = m_rispec_specular;
        program.gathers_light = m_gathers_light;
        program.own_light = !options.projected.empty();
        const ir::LowerResult lowered =
            ir::lower(program, *m_sema, m_diagnostics, *m_unit.shaders[0], options);
        if (!ok())
            return std::nullopt;
        if (lowered.missed_shaders && !options.any_shader) {
            options.any_shader = true;
            continue;
        }
        std::map<int, Loc> failed = ir::extract_closures(program, m_diagnostics, m_strict);
        if (m_strict)
            for (const auto& [number, at] : failed)
                m_diagnostics.error(at,
                                    "this kernel of an illuminance loop is not that of a lobe. Known are Cl "
                                    "times N . L, pow(N . H, n), pow(R . L, n) and specularbrdf()");
        if (!ok())
            return std::nullopt;
        const size_t before = options.projected.size();
        options.projected.merge(failed);
        again = options.projected.size() > before;
    }
    for (ir::Stage* s : program.stages()) {
        ir::simplify(*s);
        if (!s->root)
            continue;
        ir::number_texts(*s, all_varying(program), m_diagnostics);
        ir::Stage checked = *s;
        ir::infer_detail(checked, all_varying(program), &m_diagnostics);
        s->reads = ir::find_reads(*s);
        if (s == &program.shade)
            ir::check_directions(program, program.Ci >= 0 && !m_strict, m_diagnostics);
    }
    if (!ok())
        return std::nullopt;
    annotate(m_source.pragmas, program.parameters);
    find_textures(program);
    for (const ir::Stage* s : {&program.displace, &program.shade, &program.filter})
        for (const ir::CallSite& c : s->calls)
            program.queries = program.queries || c.kind == ir::CallKind::Found;
    program.coshaders = m_sema->coshader_use();
    program.source_hash = m_source.hash;
    std::string linked; // co-shaders make another shader of it
    for (const Unit& unit : m_units)
        linked += (unit.given.layer ? "layer " : "") + unit.given.handle + "\n" + unit.given.category + "\n" +
                  std::to_string(unit.source.hash) + "\n";
    for (const Connection& c : m_connections) {
        linked += c.parameter;
        for (const std::string& handle : c.handles)
            linked += "\n " + handle;
        linked += "\n" + c.output + "\n";
    }
    if (!linked.empty())
        program.source_hash = hash_bytes(linked.data(), linked.size(), program.source_hash);
    for (uint32_t f = 0; f < m_sources.count(); f++)
        program.files.push_back(m_sources.name(f));
    return program;
}

} // namespace kanuka::sl
