// The Mnk calls. In mnk_init they become host calls that build the layering program; in mnk_prelighting
// SetLobe and its kin write channels: one variable for every weight and input that the shader sets, by the
// name of its lobe.
#pragma once

#include <optional>
#include <set>

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class MaterialLowerer : public Lowerer {
  public:
    using Lowerer::Lowerer;
    void begin_stage() { m_channel_vars.clear(); }
    void material(const ast::Expr* e, const ops::Signature& s);
    void bind_lobe(const ast::VarDecl* v, const ast::Expr* init);
    void check_layers(); // at the end of mnk_init
    void channel_outputs(Stage& stage);
    std::string constant_text(const ast::Expr* e, const char* what);

  private:
    struct LobeValue {
        grid::LobeId lobe;
        std::vector<Ref> inputs; // None = not given
    };
    // What mnk_init adds, as far as its names are constants.
    struct AddedNodes {
        std::map<std::string, std::set<grid::LobeId>> lobes; // with what they may be
        std::set<std::string> layers;
        std::vector<CallSite> joins; // AddLayer
        bool open = false;           // there are more, whose names only the run time knows
    };
    bool only_in(Role role, const ast::Expr* e, const char* stage);
    void add_node(const ast::Expr* e, CallKind kind);
    void set_lobe(const ast::Expr* e);
    void set_layer(const ast::Expr* e);
    void set_presence(const ast::Expr* e);
    void set_interior(const ast::Expr* e, CallKind kind);
    LobeValue lobe_value(const ast::Expr* e);
    void set_channel(const std::string& node, int input, grid::LobeId lobe, Ty ty, Ref value, Loc at);
    int channel(const std::string& node, int input, grid::LobeId lobe, Ty ty, bool presence, Loc at);
    void note_added(const CallSite& site);
    bool is_added(const std::string& name, Loc at, std::optional<grid::LobeId> lobe);
    std::string known_nodes(const std::string& name) const;

    std::unordered_map<int, int> m_channel_vars; // of the stage
    std::map<std::string, int> m_channels;       // by node and input
    AddedNodes m_added;
};

} // namespace kanuka::sl::ir
