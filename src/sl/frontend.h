// Source text, or a published shader, to IR: what runs before code is made, and what a reader may look at on
// the way.
#pragma once

#include <deque>
#include <optional>

#include "sl/ir/passes.h"
#include "sl/parse/token.h"
#include "sl/sema/linked.h"
#include "sl/sema/sema.h"
#include "sl/slo.h"

namespace kanuka::sl {

class FrontEnd {
  public:
    // Reads and preprocesses, or unpacks a published shader. What is wrong goes to the journal.
    FrontEnd(const std::string& name, std::string text, const CompileOptions& options, Journal& journal);

    // The following steps end in nothing, or false, if there were errors, here or before.
    bool check(); // parses, and finds what everything means
    std::optional<ir::Program> lower();

    bool ok() const { return m_diagnostics.errors() == 0; }
    Sources& sources() { return m_sources; }
    const Preprocessed& source() const { return m_source; }
    const ast::Unit& tree() const { return m_unit; } // after check()
    const ast::ShaderDecl& shader() const { return *m_unit.shaders[0]; }

  private:
    void parse_and_check();
    std::optional<ir::Program> check_and_lower();
    Preprocessed read(const std::string& name, std::string text, const CompileOptions& options);
    void link();

    // A co-shader that is compiled into the shader.
    struct Unit {
        CoShader given;
        Preprocessed source;
        ast::Unit tree;
        std::optional<Sema> sema;
    };
    Sources m_sources;
    Diagnostics m_diagnostics;
    bool m_strict; // directions that no lobe takes are errors
    std::vector<std::string> m_aovs;
    std::deque<Unit> m_units;
    std::vector<Connection> m_connections; // of the shader, then those of the co-shaders, as "handle.name"
    int m_array_room;
    Linked m_linked;
    bool m_area_light, m_rispec_specular, m_gathers_light;
    Preprocessed m_source;
    ast::Arena m_arena;
    ast::Unit m_unit;
    std::optional<Sema> m_sema;
};

// A variant in which everything varies that may.
ir::Variant all_varying(const ir::Program& program);

} // namespace kanuka::sl
