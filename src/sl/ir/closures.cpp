// Reading a classic surface: the order of the work.
#include "sl/ir/extraction.h"

namespace kanuka::sl::ir {

Extraction::Extraction(Program& program, Diagnostics& diagnostics, bool strict)
    : m_program(program), m_stage(program.shade), m_diagnostics(diagnostics), m_b(program.shade),
      m_strict(strict) {}

std::map<int, Loc> Extraction::run() {
    m_directions = find_directions(m_stage);
    find_colored();
    find_sites(*m_stage.root);
    find_used();
    m_refs.resize(m_stage.instrs.size());
    m_vars.resize(m_stage.vars.size());
    m_declared.resize(m_stage.vars.size());
    m_plain_only.resize(m_stage.vars.size());
    m_plain_only[size_t(m_program.Oi)] = true;
    for (size_t v = 0; v < m_vars.size(); v++)
        m_plain_only[v] = m_plain_only[v] || m_stage.vars[v].counts;
    for (const Output& o : m_stage.outputs)
        if (o.var >= 0 && o.var != m_program.Ci)
            m_plain_only[size_t(o.var)] = true;
    for (const Site& s : m_sites)
        if (s.reference >= 0)
            m_plain_only[size_t(s.reference)] = true;
    for (bool changed = true; changed;)
        changed = flow(*m_stage.root);
    for (int s : m_vars[size_t(m_program.Ci)].sites) // Cl without a kernel, or a cosine without Cl
        if (in_loop(m_sites[size_t(s)].kind))
            not_a_lobe({{s}, false}, m_sites[size_t(s)].loc);
    if (!m_failed.empty())
        return m_failed;
    int said = 0;
    for (const auto& [line, complaint] : m_complaints) {
        if (m_strict) {
            m_diagnostics.error(complaint.first, complaint.second);
        } else if (said++ < MaxComplaints) {
            const int more = int(m_complaints.size()) - MaxComplaints;
            m_diagnostics.warning(complaint.first,
                                  complaint.second +
                                      (said == MaxComplaints && more > 0
                                           ? " (the same in " + std::to_string(more) + " lines more)"
                                           : std::string()));
        }
    }

    find_normals();
    make_variables();
    Block* const old = m_stage.root;
    m_stage.root = m_stage.block();
    m_b.set_block(m_stage.root);
    for (const int v : m_new_vars)
        m_b.declare(v);
    for (const Site& s : m_sites)
        for (int v : {s.shape, s.eta})
            if (v >= 0 && s.first < 0)
                m_b.store(v, m_b.constant(v == s.eta ? 1.0f : 0.1f), s.loc);
    for (const Site& s : m_sites)
        if (s.aim >= 0)
            m_b.store(s.aim, m_b.leaf(Op::Input, Ty::Triple, int(Input::N)), s.loc);
    if (m_normal >= 0)
        m_b.store(m_normal, m_b.leaf(Op::Input, Ty::Triple, int(Input::N)), {});
    rewrite(*old);
    if (m_normal >= 0)
        m_stage.outputs.push_back({Output::Normal, m_normal, 0});
    write_lobes(m_program, m_b, {m_sites, m_parts[size_t(m_program.Ci)], m_vars[size_t(m_program.Ci)].plain});
    return {};
}

// One complaint a line: what is in it hangs together.
void Extraction::complain(Loc at, const std::string& what) {
    m_complaints.try_emplace({at.file, at.line}, at, what);
}

std::map<int, Loc> extract_closures(Program& program, Diagnostics& diagnostics, bool strict) {
    if (program.Ci < 0 || !program.shade.root)
        return {};
    choose_pictures(program.shade, strict);
    rename_assignments(program);
    return Extraction(program, diagnostics, strict).run();
}

} // namespace kanuka::sl::ir
