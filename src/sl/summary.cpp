#include "sl/summary.h"

#include "sl/bytes.h"

namespace kanuka::sl {

namespace {

static_assert(sizeof(ir::Program) == ProgramSize);

void put_texts(ByteWriter& out, const std::vector<std::string>& texts) {
    out.count(texts.size());
    for (const std::string& s : texts)
        out.text(s);
}
std::vector<std::string> get_texts(ByteReader& in) {
    std::vector<std::string> texts(in.length());
    for (std::string& s : texts)
        s = in.text();
    return texts;
}

void put_loc(ByteWriter& out, Loc at) {
    out.count(at.file);
    out.count(at.line);
    out.count(at.column);
}
Loc get_loc(ByteReader& in) {
    Loc at;
    at.file = uint32_t(in.count());
    at.line = uint32_t(in.count());
    at.column = uint32_t(in.count());
    return at;
}

// ---- the program

void put_places(ByteWriter& out, const std::vector<ir::Place>& places) {
    out.count(places.size());
    for (const ir::Place& p : places) {
        out.count(uint64_t(p.offset));
        out.count(uint64_t(p.count));
        out.put(uint8_t(p.text | p.varying << 1));
        out.put(int32_t(p.length));
    }
}
std::vector<ir::Place> get_places(ByteReader& in) {
    std::vector<ir::Place> places(in.length(3));
    for (ir::Place& p : places) {
        p.offset = int(in.count());
        p.count = int(in.count());
        const uint8_t flags = in.get<uint8_t>();
        p.text = flags & 1;
        p.varying = flags & 2;
        p.length = in.get<int32_t>();
    }
    return places;
}

void put_outputs(ByteWriter& out, const std::vector<ir::Output>& outputs, const ir::Stage* stage) {
    out.count(outputs.size());
    for (const ir::Output& o : outputs) {
        const bool varying = stage && o.var >= 0 && stage->vars[size_t(o.var)].varying;
        out.put(uint8_t(o.kind | (o.var >= 0) << 4 | varying << 5));
        out.put(uint8_t(stage && o.var >= 0 ? stage->vars[size_t(o.var)].ty : ir::Ty::Float));
        out.count(uint64_t(o.index));
        out.count(uint64_t(o.element));
    }
}
// Each output has a variable of its own, which says of what type it is and whether it varies.
void get_outputs(ByteReader& in, ir::Stage& stage) {
    stage.outputs.resize(in.length(3));
    for (ir::Output& o : stage.outputs) {
        const uint8_t flags = in.get<uint8_t>();
        const auto ty = ir::Ty(in.get<uint8_t>());
        o.kind = ir::Output::Kind(flags & 15);
        o.index = int(in.count());
        o.element = int(in.count());
        if (flags & 16) {
            o.var = int(stage.vars.size());
            ir::Var& var = stage.vars.emplace_back();
            var.varying = flags & 32;
            var.ty = ty;
        }
    }
}

void put_program(ByteWriter& out, const ir::Program& p) {
    out.put(uint8_t(p.kind));
    out.text(p.name);
    out.count(p.parameters.size());
    for (const Parameter& q : p.parameters) {
        out.text(q.name);
        out.put(uint8_t(uint8_t(q.type) | q.varying << 4 | q.output << 5 | q.resizable << 6));
        out.count(uint64_t(q.array_size));
        out.list(q.floats);
        put_texts(out, q.strings);
        out.text(q.doc);
    }
    put_places(out, p.places);
    put_places(out, p.members);
    for (const int n : {p.carried, p.floats, p.strings, p.member_floats, p.member_strings})
        out.count(uint64_t(n));
    out.count(p.channels.size());
    for (const ir::Channel& c : p.channels) {
        out.text(c.node);
        out.put(int16_t(c.input));
        out.put(uint8_t(c.lobe));
        out.put(uint8_t(c.presence | c.ambient << 1 | c.unsure << 2 | c.as_os << 3 | (c.opacity + 1) << 4));
        out.put(uint8_t(c.ty));
    }
    out.count(p.fixed_lobes.size());
    for (const auto& [name, lobe] : p.fixed_lobes) {
        out.text(name);
        out.put(uint8_t(lobe));
    }
    put_texts(out, p.files);
    out.count(p.textures.size());
    for (const TextureUse& t : p.textures) {
        out.text(t.file);
        out.text(t.parameter);
        out.put(uint8_t(t.environment));
    }
    out.put(uint8_t(p.queries | p.interreflection << 1 | p.own_light << 2));
    out.put(uint8_t(p.coshaders));
    put_texts(out, p.aovs);
    out.put(p.source_hash);
    for (const ir::Stage* s : p.stages()) {
        out.put(uint8_t(s->root != nullptr));
        out.text(s->name);
        out.put(
            uint8_t(s->reads.parameters | s->reads.texture << 1 | s->reads.frame << 2 | s->reads.eye << 3));
        out.put(uint8_t(s->reads.rings));
        put_outputs(out, s->outputs, nullptr);
    }
}

void get_program(ByteReader& in, ir::Program& p) {
    p.kind = ShaderKind(in.get<uint8_t>());
    p.name = in.text();
    p.parameters.resize(in.length(6));
    for (Parameter& q : p.parameters) {
        q.name = in.text();
        const uint8_t flags = in.get<uint8_t>();
        q.type = Type(flags & 15);
        q.varying = flags & 16;
        q.output = flags & 32;
        q.resizable = flags & 64;
        q.array_size = int(in.count());
        q.floats = in.list<float>();
        q.strings = get_texts(in);
        q.doc = in.text();
    }
    p.places = get_places(in);
    p.members = get_places(in);
    for (int* n : {&p.carried, &p.floats, &p.strings, &p.member_floats, &p.member_strings})
        *n = int(in.count());
    p.channels.resize(in.length(6));
    for (ir::Channel& c : p.channels) {
        c.node = in.text();
        c.input = in.get<int16_t>();
        c.lobe = grid::LobeId(in.get<uint8_t>());
        const uint8_t special = in.get<uint8_t>();
        c.presence = special & 1, c.ambient = special & 2, c.unsure = special & 4;
        c.as_os = special & 8, c.opacity = int8_t((special >> 4) - 1);
        c.ty = ir::Ty(in.get<uint8_t>());
    }
    p.fixed_lobes.resize(in.length(2));
    for (auto& [name, lobe] : p.fixed_lobes) {
        name = in.text();
        lobe = grid::LobeId(in.get<uint8_t>());
    }
    p.files = get_texts(in);
    p.textures.resize(in.length(3));
    for (TextureUse& t : p.textures) {
        t.file = in.text();
        t.parameter = in.text();
        t.environment = in.get<uint8_t>();
    }
    const uint8_t asks = in.get<uint8_t>();
    p.queries = asks & 1;
    p.interreflection = asks & 2;
    p.own_light = asks & 4;
    p.coshaders = CoShaderUse(in.get<uint8_t>());
    p.aovs = get_texts(in);
    p.source_hash = in.get<uint64_t>();
    for (ir::Stage* s : p.stages()) {
        if (in.get<uint8_t>())
            s->root = s->block();
        s->name = in.text();
        const uint8_t reads = in.get<uint8_t>();
        s->reads = {bool(reads & 1), bool(reads & 2), bool(reads & 4), bool(reads & 8), in.get<uint8_t>()};
        get_outputs(in, *s);
    }
}

// ---- stages

// Call sites keep their numbers, which the code names; of their arguments, type and detail are kept.
void put_stage(ByteWriter& out, const BuiltStage& built) {
    const ir::Stage& s = built.stage;
    out.put(uint8_t(s.root != nullptr));
    if (!s.root)
        return;
    out.text(s.name);
    for (const int n : {built.plan.uniforms, built.plan.texts, built.plan.arrays})
        out.count(uint64_t(n));
    put_outputs(out, s.outputs, &s);
    out.count(s.faults.size());
    for (const auto& [at, what] : s.faults) {
        put_loc(out, at);
        out.text(what);
    }
    const auto value = [&](ir::Ref r) {
        const ir::Instr& i = s.instrs[size_t(r)];
        out.put(uint8_t(uint8_t(i.ty) | i.varying << 7));
    };
    out.count(s.calls.size());
    for (const ir::CallSite& c : s.calls) {
        out.put(uint8_t(c.kind));
        put_loc(out, c.loc);
        out.put(int32_t(c.imm));
        put_texts(out, c.names);
        out.count(c.args.size());
        for (const ir::Ref a : c.args)
            value(a);
        out.put(uint8_t(c.result != ir::None));
        if (c.result != ir::None)
            value(c.result);
    }
}

void get_stage(ByteReader& in, BuiltStage& built) {
    ir::Stage& s = built.stage;
    if (!in.get<uint8_t>())
        return;
    s.root = s.block();
    s.name = in.text();
    for (int* n : {&built.plan.uniforms, &built.plan.texts, &built.plan.arrays})
        *n = int(in.count());
    get_outputs(in, s);
    s.faults.resize(in.length(4));
    for (auto& [at, what] : s.faults) {
        at = get_loc(in);
        what = in.text();
    }
    const auto value = [&] {
        const uint8_t flags = in.get<uint8_t>();
        ir::Instr& i = s.instrs.emplace_back();
        i.op = ir::Op::Load;
        i.ty = ir::Ty(flags & 127);
        i.varying = flags & 128;
        return ir::Ref(s.instrs.size() - 1);
    };
    s.calls.resize(in.length(10));
    for (ir::CallSite& c : s.calls) {
        c.kind = ir::CallKind(in.get<uint8_t>());
        c.loc = get_loc(in);
        c.imm = in.get<int32_t>();
        c.names = get_texts(in);
        for (size_t n = in.length(); n > 0; n--)
            c.args.push_back(value());
        if (in.get<uint8_t>())
            c.result = value();
    }
}

void put_messages(ByteWriter& out, const std::vector<Journal::Entry>& messages, const std::string& name) {
    out.count(messages.size());
    for (const Journal::Entry& e : messages) {
        out.put(uint8_t(e.severity));
        out.text(e.where.file == name ? std::string_view() : e.where.file.str());
        out.count(uint64_t(e.where.line));
        out.count(uint64_t(e.where.column));
        out.text(e.message);
        out.count(e.count);
    }
}
std::vector<Journal::Entry> get_messages(ByteReader& in, const std::string& name) {
    std::vector<Journal::Entry> messages(in.length(6));
    for (Journal::Entry& e : messages) {
        e.severity = Severity(in.get<uint8_t>());
        e.where.file = in.text();
        if (e.where.file.empty())
            e.where.file = name;
        e.where.line = int(in.count());
        e.where.column = int(in.count());
        e.message = in.text();
        e.count = in.count();
    }
    return messages;
}

} // namespace

std::string pack_entry(const ir::Program& program, const std::vector<Journal::Entry>& messages,
                       const Build& build, const std::vector<bool> (&uniform)[4], bool first,
                       const std::string& name, std::string_view object) {
    ByteWriter out;
    if (first) {
        put_program(out, program);
        put_messages(out, messages, name);
    }
    for (const BuiltStage* s : build.stages())
        put_stage(out, *s);
    for (const std::vector<bool>& list : uniform) {
        out.count(list.size());
        for (const bool u : list)
            out.put(uint8_t(u));
    }
    const std::string about = out.take();
    ByteWriter size;
    size.put(uint64_t(about.size()));
    std::string entry = size.take();
    entry.reserve(entry.size() + about.size() + object.size());
    entry += about;
    entry += object;
    return entry;
}

bool unpack_entry(std::string_view entry, bool first, const std::string& name, Summary& summary,
                  std::string_view& object) {
    ByteReader all(entry);
    const uint64_t size = all.get<uint64_t>();
    const std::string_view rest = all.rest();
    if (!all.ok() || size > rest.size())
        return false;
    ByteReader in(rest.substr(0, size));
    object = rest.substr(size);
    if (first) {
        get_program(in, summary.program);
        if (!summary.program.files.empty() && !name.empty())
            summary.program.files[0] = name;
        summary.messages = get_messages(in, name);
    }
    for (BuiltStage* s : summary.build.stages())
        get_stage(in, *s);
    for (std::vector<bool>& uniform : summary.uniform) {
        uniform.resize(in.length());
        for (size_t k = 0; k < uniform.size(); k++)
            uniform[k] = in.get<uint8_t>();
    }
    return in.ok() && in.at_end();
}

} // namespace kanuka::sl
