#include "sl/ir/lower/handles.h"

namespace kanuka::sl::ir {

using namespace ast;

HandleTracker::HandleTracker(LowerContext& context) : Lowerer(context) {
    for (const Connection& c : context.options.connections)
        if (c.output.empty())
            m_connections[c.parameter] = &c.handles;
        else
            m_layered[c.parameter] = &c;
}

void HandleTracker::begin_stage() {
    m_stores_seen = 0;
    m_stored.clear();
    m_asked.clear();
}

void HandleTracker::end_stage() {
    for (const auto& [handle, found] : m_asked)
        m_missed = m_missed || find(handle) != found;
}

const std::vector<std::string>* HandleTracker::connected(const std::string& parameter) const {
    const auto it = m_connections.find(parameter);
    return it == m_connections.end() ? nullptr : it->second;
}

const Connection* HandleTracker::layered(const std::string& parameter) const {
    const auto it = m_layered.find(parameter);
    return it == m_layered.end() ? nullptr : it->second;
}

std::string HandleTracker::known(const std::string& handle) const {
    return m_context.linked && m_context.linked->find(handle) >= 0 ? handle : std::string();
}

std::vector<int> HandleTracker::targets(Ref handle) {
    std::vector<int> found = find(handle);
    m_asked.emplace_back(handle, found);
    return found;
}

// The co-shaders that a handle may stand for.
std::vector<int> HandleTracker::find(Ref handle) {
    note_stores();
    std::vector<bool> may(m_context.linked->units.size(), false);
    std::vector<bool> seen(m_b.stage().vars.size(), false);
    std::vector<Ref> work = {handle};
    const auto all = [&] { may.assign(may.size(), true); };
    while (!work.empty()) {
        const Ref r = work.back();
        work.pop_back();
        const Instr& i = m_b.at(r);
        switch (i.op) {
        case Op::Text:
            if (const int u = m_context.linked->find(i.text); u >= 0)
                may[size_t(u)] = true;
            break;
        case Op::Select:
            work.push_back(i.args[1]);
            work.push_back(i.args[2]);
            break;
        case Op::Load:
        case Op::LoadElement:
            if (m_context.options.any_shader)
                all();
            if (!seen[size_t(i.imm)]) {
                seen[size_t(i.imm)] = true;
                const std::vector<Ref>& stored = m_stored[i.imm];
                work.insert(work.end(), stored.begin(), stored.end());
            }
            break;
        case Op::Param: // a string that names a co-shader is connected, and no parameter any more
            break;
        case Op::Member: // what mnk_init left
            if (m_program.init.root)
                all();
            break;
        default:
            all();
        }
    }
    std::vector<int> found;
    for (size_t u = 0; u < may.size(); u++)
        if (may[u])
            found.push_back(int(u));
    return found;
}

// Takes up the stores that were made since the last time.
void HandleTracker::note_stores() {
    const std::vector<Instr>& instrs = m_b.stage().instrs;
    for (; m_stores_seen < instrs.size(); m_stores_seen++) {
        const Instr& i = instrs[m_stores_seen];
        if (i.op == Op::Store && m_b.at(i.args[0]).ty == Ty::String)
            m_stored[i.imm].push_back(i.args[0]);
        else if (i.op == Op::StoreElement && m_b.at(i.args[1]).ty == Ty::String)
            m_stored[i.imm].push_back(i.args[1]);
    }
}

void HandleTracker::for_targets(Ref handle, const std::vector<int>& found, Loc at,
                                const std::function<void(int)>& what) {
    if (m_b.at(handle).op == Op::Text) {
        for (const int u : found)
            what(u);
        return;
    }
    for (const int u : found) {
        Item i{Item::If};
        i.ref = m_b.emit(Op::SameText, Ty::Bool,
                         {handle, m_b.text(m_context.linked->units[size_t(u)].given->handle)}, at);
        i.loc = at;
        i.body = in_block([&] { what(u); });
        i.orelse = m_b.stage().block();
        m_b.item(i);
    }
}

} // namespace kanuka::sl::ir
