#include "sl/frontend.h"

#include "sl/deep_stack.h"
#include "sl/ir/lower.h"
#include "sl/ir/passes.h"
#include "sl/parse/parser.h"

namespace kanuka::sl {

FrontEnd::FrontEnd(const std::string& name, std::string text, const CompileOptions& options, Journal& journal)
    : m_diagnostics(m_sources, journal), m_strict(options.strict_directions), m_aovs(options.aovs),
      m_area_light(options.area_light) {
    if (is_slo(text)) {
        std::string problem;
        if (std::optional<Published> published = read_slo(text, problem); published && problem.empty())
            m_source = unpack(*published, m_sources, problem);
        if (!problem.empty())
            throw Error({name}, problem);
        return;
    }
    const uint32_t file = m_sources.add(name, std::move(text));
    run_deep([&] {
        m_source = preprocess(m_sources, file, options.include_path, options.defines, m_diagnostics);
    });
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
    m_sema.emplace(m_arena, m_diagnostics);
    m_sema->check(m_unit, *m_unit.shaders[0]);
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
    std::map<int, Loc> projected;
    for (bool again = true; again;) {
        program = {};
        program.aovs = m_aovs;
        program.area_light = m_area_light;
        ir::Lower(program, *m_sema, m_diagnostics, *m_unit.shaders[0], projected).run();
        if (!ok())
            return std::nullopt;
        std::map<int, Loc> failed = ir::extract_closures(program, m_diagnostics, m_strict);
        if (m_strict)
            for (const auto& [number, at] : failed)
                m_diagnostics.error(at,
                                    "this kernel of an illuminance loop is not that of a lobe. Known are Cl "
                                    "times N . L, pow(N . H, n), pow(R . L, n) and specularbrdf()");
        if (!ok())
            return std::nullopt;
        const size_t before = projected.size();
        projected.merge(failed);
        again = projected.size() > before;
    }
    for (ir::Stage* s : program.stages()) {
        ir::simplify(*s);
        if (!s->root)
            continue;
        ir::number_texts(*s, all_varying(program), m_diagnostics);
        ir::Stage checked = *s;
        ir::infer_detail(checked, all_varying(program), &m_diagnostics);
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
    program.source_hash = m_source.hash;
    for (uint32_t f = 0; f < m_sources.count(); f++)
        program.files.push_back(m_sources.name(f));
    return program;
}

} // namespace kanuka::sl
