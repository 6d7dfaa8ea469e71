// Publishing shaders, and showing what becomes of them.
#include "sl/codegen/codegen.h"
#include "sl/frontend.h"
#include "sl/print/print.h"
#include "sl/shader.h"
#include "sl/slo.h"

namespace kanuka::sl {

std::optional<std::string> publish(const std::string& name, const std::string& source,
                                   const CompileOptions& options, Journal& journal) {
    try {
        FrontEnd front(name, source, options, journal);
        const std::optional<ir::Program> program = front.lower();
        if (!program)
            return std::nullopt;
        return write_slo(front.sources(), front.source(), *program);
    } catch (const Error& e) {
        journal.error({name}, e.what());
        return std::nullopt;
    }
}

std::string published_metadata(const std::string& name, std::string_view bytes) {
    std::string problem;
    std::optional<Published> published = read_slo(bytes, problem, true);
    if (!published)
        throw Error({name}, problem);
    return std::move(published->metadata);
}

// ---- showing

// Tokens as text, with line marks where the place jumps.
static std::string token_text(const FrontEnd& front, const Sources& sources) {
    std::string out;
    Loc last;
    bool word = false; // macros may leave words side by side
    for (const Token& t : front.source().tokens) {
        if (t.kind == Token::End)
            break;
        const bool near = t.loc.file == last.file && t.loc.line >= last.line && t.loc.line < last.line + 4;
        if (!near || last.line == 0)
            out += (out.empty() ? "" : "\n") + std::string("#line ") + std::to_string(t.loc.line) + " \"" +
                   sources.name(t.loc.file) + "\"\n" + std::string(t.loc.column ? t.loc.column - 1 : 0, ' ');
        else if (t.loc.line > last.line)
            out += std::string(t.loc.line - last.line, '\n') +
                   std::string(t.loc.column ? t.loc.column - 1 : 0, ' ');
        else if (t.space_before || (word && t.kind != Token::Punctuation))
            out += ' ';
        word = t.kind != Token::Punctuation;
        last = t.loc;
        if (t.kind != Token::String) {
            out += t.text;
            continue;
        }
        out += '"';
        for (const char c : t.text)
            out += c == '\n'               ? "\\n"
                   : c == '\t'             ? "\\t"
                   : c == '\r'             ? "\\r"
                   : c == '"' || c == '\\' ? std::string("\\") + c
                                           : std::string(1, c);
        out += '"';
    }
    return out + "\n";
}

namespace {
struct StageName {
    std::string_view name;
    ir::Stage ir::Program::* stage;
    const char* symbol;
    bool once; // an instance, on one lane
};
constexpr StageName Stages[] = {
    {"defaults", &ir::Program::defaults, "kanuka_defaults", true},
    {"init", &ir::Program::init, "kanuka_init", true},
    {"interior", &ir::Program::interior, "kanuka_interior", true},
    {"displacement", &ir::Program::displace, "kanuka_displace", false},
    {"prelighting", &ir::Program::shade, "kanuka_shade", false},
    {"light", &ir::Program::light, "kanuka_light", false},
    {"filter", &ir::Program::filter, "kanuka_filter", false},
};
} // namespace

std::vector<std::string> emit_stages() {
    std::vector<std::string> names;
    for (const StageName& s : Stages)
        names.emplace_back(s.name);
    return names;
}

std::optional<std::string> emit(const std::string& name, const std::string& source, Emit what,
                                const std::string& stage, const CompileOptions& options, Journal& journal) {
    try {
        FrontEnd front(name, source, options, journal);
        if (what == Emit::Rsl)
            return front.ok() ? std::optional(token_text(front, front.sources())) : std::nullopt;
        if (what == Emit::Ast)
            return front.check() ? std::optional(print_tree(front.shader(), front.sources())) : std::nullopt;
        const std::optional<ir::Program> program = front.lower();
        if (!program)
            return std::nullopt;
        const int lanes = usable_lanes(options.lanes);
        std::vector<StageToCompile> list;
        std::deque<BuiltStage> built;
        std::string text;
        for (const StageName& s : Stages) {
            const ir::Stage& from = (*program).*s.stage;
            if (!from.root || (!stage.empty() && stage != s.name))
                continue;
            if (s.name == "defaults" && from.outputs.empty())
                continue; // all of them are constants
            if (what == Emit::C) {
                ir::Stage inferred = from;
                ir::infer_detail(inferred, {}, nullptr);
                text += (text.empty() ? "" : "\n") + print_c(*program, inferred, front.sources());
                continue;
            }
            prepare(built.emplace_back(), from, {}, s.symbol, s.once ? 1 : lanes, list);
            if (what == Emit::Ir)
                text += (text.empty() ? "" : "\n") +
                        print_ir(*program, built.back().stage, built.back().plan, front.sources());
        }
        if (what == Emit::Llvm || what == Emit::Asm)
            text = compile_text(*program, list, lanes, options.opt_level, what == Emit::Asm);
        else if (text.empty())
            text = "// the shader has no " + (stage.empty() ? "code" : stage + " stage") + "\n";
        return text;
    } catch (const Error& e) {
        journal.error({name}, e.what());
        return std::nullopt;
    }
}

} // namespace kanuka::sl
