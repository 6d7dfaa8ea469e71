// Reading a classic surface's Ci as a material.
//
// A colour that contains light is linear in it: C = plain + sum of w_k light_k, with one term, a *site*, for
// each call of diffuse(), specular(), … in the inlined shader. So every variable and value that may contain
// light becomes a bundle of ordinary colours, its plain part and its weights, and +, -, * and ?: act on the
// parts; if and loops act on the parts' variables like on any other.
//
// Published shaders do more to light than that: pow(), clamp(), conditions. Such a function of light is
// replaced by its chord: its value without light stays plain, and what it gains where all light is one (a
// white surface, fully lit) becomes the weight of its terms. Both ends are exact, also after several such
// steps, and what is linear after all stays so. Conditions are taken at full light, and what they decide
// about is light.
#pragma once

#include <set>

#include "sl/ir/light_terms.h"

namespace kanuka::sl::ir {

// Sites that a value may contain, and whether it may have a part without light. A Bool that depends on light
// has the sites of what it compares.
struct Contents {
    std::vector<int> sites; // sorted
    bool plain = false;
    bool merge(const Contents& o);
};

// By site; Plain = the part without light. Of a Bool: its value without light, and at full light.
using Bundle = std::map<int, Ref>;
inline constexpr int Plain = -1, AtFullLight = -2;

class Extraction {
  public:
    Extraction(Program& program, Diagnostics& diagnostics, bool strict);
    // Illuminance loops, by number, that are no lobes, and where that shows. If there are any, the program is
    // of no use: lower it again with these loops projected.
    std::map<int, Loc> run();

  private:
    static constexpr int MaxComplaints = 4; // lines; a shader that draws pictures with light has a hundred
    // A condition on light, or a loop over directions: what is stored within depends on light.
    struct Context {
        bool loop = false;
        int carrier = -1;      // site that the light goes to
        int loops = 0;         // loops around it
        std::set<int> scratch; // variables that are set anew within a loop: no sums over lights
    };

    void complain(Loc at, const std::string& what);

    // closures_sites.cpp: the terms
    void find_colored();
    void find_sites(Block& b);
    void find_used();
    void check_arguments(Instr& i);
    Contents contents(Ref r);
    Contents arguments(const Instr& i);
    int product(int a, int b);
    int carrier(const Contents& c) const;

    // closures_flow.cpp: what holds light
    void not_a_lobe(const Contents& c, Loc at);
    void nonlinear(const Instr& i, const Contents& c);
    bool flow(const Block& b);
    bool skips_little(const Instr& i);
    bool flow_instruction(Ref r);
    bool flow_store(const Instr& i, Ref value);
    void flow_product(const Instr& i, Contents& c);
    Contents nonlinear_contents(const Instr& i, const Contents& lit);
    bool enter(const Item& item);
    void find_scratch(const Block& b, std::set<int>& scratch);
    const Context* context_of(int var) const;
    bool accumulates(const Instr& store, const Context& context);
    bool reads(Ref r, int var, int depth);

    // closures_rewrite.cpp: computing with it
    void find_normals();
    bool is_bump(Ref r, std::set<Ref>& seen);
    void make_variables();
    Bundle bundle(Ref r);
    Ref zero_of(Ty ty, float x = 0) { return ty == Ty::Float ? m_b.constant(x) : m_b.triple(x); }
    Ref value(Ref r, bool lit);
    Ref reference(int site, Ty ty, Loc at);
    Ref finite(Ref r, Loc at);
    void rewrite(const Block& b);
    void instruction(const Item& item);
    void store(const Instr& i);
    void replace_arguments(Ref r);
    Bundle term(Ref r, const Instr& i);
    Bundle load(const Instr& i);

    // closures_operators.cpp
    Bundle make(const Instr& i);
    Bundle sum(const Instr& i);
    Bundle multiply(const Instr& i);
    Bundle chord(const Instr& i);
    Bundle select(const Instr& i);
    void spread(Bundle& out, const Instr& i, Ref dark, Ref bright);

    Program& m_program;
    Stage& m_stage;
    Diagnostics& m_diagnostics;
    Builder m_b;
    bool m_strict;
    Directions m_directions;
    std::vector<Site> m_sites;
    std::map<Ref, int> m_site_of;
    std::vector<bool> m_used; // by value: what nothing takes need not be linear in light
    std::map<std::pair<int, int>, int> m_products;
    std::vector<Contents> m_refs, m_vars;
    std::vector<std::map<int, int>> m_parts; // by variable: a variable for each site
    std::vector<bool> m_plain_only;          // by variable: leaves the stage as it is
    std::vector<int> m_new_vars;
    std::map<Ref, Bundle> m_bundles;
    std::vector<Context> m_contexts;
    std::vector<int> m_declared; // by variable: contexts around its declaration
    int m_loops = 0;             // loops around what is being walked
    static constexpr int MostAims = 4;
    int m_aims = 0;                   // directions of trace() that do not depend on the view
    int m_normal = -1;                // variable: the normal that lobes are given, where it is not N
    std::set<Ref> m_normals;          // closures that give it
    std::multimap<int, Ref> m_stores; // by variable, while find_normals runs
    std::set<int> m_colored;          // illuminance loops that use Cl
    std::map<int, Loc> m_failed;
    std::map<std::pair<uint32_t, uint32_t>, std::pair<Loc, std::string>> m_complaints; // by line
};

} // namespace kanuka::sl::ir
