// Typed tree to IR: one Stage for each entry point, functions inlined, the Mnk calls turned into channels and
// host calls.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>

#include "sl/ir/builder.h"
#include "sl/ops/noise.h"
#include "sl/sema/linked.h"
#include "sl/sema/sema.h"

namespace kanuka::sl::ir {

bool has_return(const ast::Stmt* s); // anywhere in it

class Lower {
  public:
    // projected: illuminance loops, by number, that closures.cpp could not read as lobes, and where it gave
    // up.
    // any_shader: variables' handles stand for any co-shader.
    Lower(Program& program, Sema& sema, Diagnostics& diagnostics, ast::ShaderDecl& shader,
          const std::map<int, Loc>& projected = {}, const std::vector<Connection>& connections = {},
          bool any_shader = false, int array_room = ResizableRoom)
        : m_program(program), m_sema(sema), m_diagnostics(diagnostics), m_shader(shader),
          m_projected(projected), m_linked(sema.linked()), m_any_shader(any_shader), m_b(program.defaults),
          m_array_room(array_room) {
        for (const Connection& c : connections)
            if (c.output.empty())
                m_connections[c.parameter] = &c.handles;
            else
                m_layered[c.parameter] = &c;
    }
    void run();
    // A call has not reckoned with a co-shader that its handle may be: the program is of no use, and
    // any_shader is wanted.
    bool missed_shaders() const { return m_missed; }

  private:
    enum class Role { Defaults, Init, Interior, Displace, Shade, Light, Filter };
    struct Binding {
        enum Kind : uint8_t { None, Value, Variable, Lobe, Handle } kind = None;
        Ref value = ir::None;    // Value
        int var = -1;            // Variable; arrays too
        int length = -1;         // of a resizable array: the variable of its length
        std::vector<int> inputs; // Lobe: a variable for each input of the lobe
        std::vector<bool> given; // Lobe: inputs that some constructor named
    };
    struct LobeValue {
        grid::LobeId lobe;
        std::vector<Ref> inputs; // None = not given
    };
    struct LoopTargets {
        int leave, next;
    };

    // lower.cpp: stages, statements
    void parameters();
    void add_parameter(const ast::VarDecl* v, std::string name);
    void default_value(const ast::VarDecl* v, int index);
    std::vector<Ref> default_values(const ast::VarDecl* v, const ast::Type& element, int size);
    static bool late_default(const ast::VarDecl* v);
    void members();
    void begin_stage(Stage& stage, Role role, const char* name);
    void end_stage();
    void class_stage(const char* method, Stage& stage, Role role);
    void classic_stage();
    void normal_output();
    void aov_outputs();
    void unset_color();
    void leave_members();
    void take_members();
    void drop_unread_members();
    ast::FunctionDecl* method(std::string_view name);
    ast::FunctionDecl* stage_method(std::string_view name);
    std::vector<ast::FunctionDecl*> lit_methods();
    void run_method(ast::FunctionDecl* f);
    void statement(const ast::Stmt* s);
    void declare(const ast::VarDecl* v);
    void declare_array(const ast::VarDecl* v);
    void branch(Ref condition, const ast::Stmt* yes, const ast::Stmt* no, Loc at);
    void loop(const ast::Stmt* s);
    void run_for(const ast::Stmt* s);
    void run_loop(Loc at, const std::function<Ref()>& condition_value, const std::function<void()>& body,
                  const std::function<void()>& step);
    void pass(const LoopTargets& targets, Loc at, const std::function<void()>& body);
    void jump(int target, Loc at);
    template <class F>
    Block* in_block(F&& body) {
        Block* const b = m_b.stage().block();
        const BlockScope scope(m_b, b);
        body();
        return b;
    }

    // Where globals get their values: before all else.
    template <class F>
    auto in_prologue(F&& make) {
        const BlockScope scope(m_b, m_prologue);
        return make();
    }

    // lower_expr.cpp
    Ref expr(const ast::Expr* e);
    Ref expr_as(const ast::Expr* e, const ast::Type& to) { return convert(expr(e), e->type, to, e->loc); }
    Ref convert(Ref value, const ast::Type& from, const ast::Type& to, Loc at);
    Ref condition(const ast::Expr* e);
    Ref truth(Ref value);
    Ref name(const ast::Expr* e);
    Ref global(const ast::VarDecl* v, Loc at);
    Ref binary(const ast::Expr* e);
    Ref arithmetic(ast::BinOp op, Ref a, const ast::Type& ta, Ref b, const ast::Type& tb,
                   const ast::Type& result, Loc at);
    Ref matrix_arithmetic(ast::BinOp op, Ref a, Ref b, Loc at);
    Ref inverse(Ref m, Loc at);
    Ref determinant(Ref m, Loc at);
    Ref comparison(ast::BinOp op, Ref a, Ref b, Loc at);
    Ref ternary(const ast::Expr* e);
    Ref index(const ast::Expr* e);
    Ref element_of_matrix(const ast::Expr* e);
    Ref component_of(Ref whole, Ref index, Loc at);
    Ref with_component(Ref whole, Ref index, Ref value, Loc at);
    Ref tuple(const ast::Expr* e);
    Ref in_space(Ref value, const ast::Type& type, const ast::Expr* space, Loc at);
    Ref assign(const ast::Expr* e);
    void assign_to(const ast::Expr* target, Ref value, Loc at);
    void assign_array(const Binding& to, const ast::Expr* value, const ast::Type& type, Loc at);
    void assign_struct(const std::vector<ast::VarDecl*>& fields, const ast::Expr* value, Loc at);
    void assign_struct_element(const ast::Expr* target, const ast::Expr* from, Loc at);
    void copy_fields(const std::vector<ast::VarDecl*>& to, const std::vector<ast::VarDecl*>& from, Loc at);
    void need_room(int var, int elements);
    Binding& bind(const ast::VarDecl* v);
    Binding bind_parameter(const ast::VarDecl* v);
    Binding bind_late(const ast::VarDecl* v, int index);
    Binding bind_array(const ast::VarDecl* v, int index, const std::vector<std::string>* handles);
    Binding bind_global(const ast::VarDecl* v);
    Ref initial_value(const ast::VarDecl* v, const ops::Global& g);
    Ref zero(Ty ty);
    int fault(Loc at, std::string what);
    Ref input(Input input);

    // lower_calls.cpp
    Ref call(const ast::Expr* e);
    using Bindings = std::vector<std::pair<const ast::VarDecl*, Binding>>;
    Ref inline_function(ast::FunctionDecl* f, const std::vector<const ast::Expr*>& args, Loc at);
    Ref struct_call(const ast::Expr* e);
    Ref inline_with(ast::FunctionDecl* f, std::vector<Binding> bindings, Loc at);
    Ref inline_placed(ast::FunctionDecl* f, Bindings bindings, Loc at);
    Ref inline_body(ast::FunctionDecl* f, Bindings bindings, Loc at);
    Ref shadeop(const ast::Expr* e);
    Ref primitive(const ast::Expr* e, const ops::Signature& s);
    Ref noise(const ast::Expr* e, const ops::Signature& s);
    Ref special(const ast::Expr* e, const ops::Signature& s);
    Ref absent(const ast::Expr* e, const ops::Signature& s);
    Ref difference(const ast::Expr* e, const ops::Signature& s);
    Ref calculate_normal(const ast::Expr* e, const ops::Signature& s);
    Ref shader_name(const ast::Expr* e);
    Ref array_op(const ast::Expr* e, ops::Special what);
    Ref struct_array_op(const ast::Expr* e, ops::Special what);
    int room(const Binding& array);
    Ref array_length(const Binding& array, Loc at);
    void push(const Binding& array, const ast::Expr* what, const ast::Type& element, Loc at);
    Ref pop(const Binding& array, Ty element, Loc at);
    void resize(const Binding& array, const ast::Expr* length, bool set, Loc at);
    Ref query(const ast::Expr* e, const ops::Signature& s);
    void answer_array(const Binding& b, Ref known, Ref value, Loc at);
    Ref inline_values(ast::FunctionDecl* f, const std::vector<Ref>& args, Loc at);
    void bind_formal(const ast::VarDecl* formal, const ast::Expr* a, Bindings& bindings,
                     std::vector<std::pair<const ast::Expr*, int>>& copies);
    Ref closure(const ast::Expr* e, const ops::Signature& s);
    Ref spline(const ast::Expr* e, const ops::Signature& s);
    Ref spline_in(const ops::SplineBasis& basis, bool solve, Ref x, const Binding& values, Ty t, Loc at);
    Ref spline_at(const ops::SplineBasis& basis, Ref x, const Binding& values, Ty t, Loc at);
    Ref texture(const ast::Expr* e, const ops::Signature& s);
    std::vector<Ref> texture_coordinates(const ast::Expr* e, bool environment);
    void place_texture(CallSite& site, const std::vector<Ref>& where);
    void texture_options(CallSite& site, const ast::Expr* e);
    Ref component(const ast::Expr* e, const ops::Signature& s);
    Ref space(const ast::Expr* e);
    Ref host(CallKind kind, const ast::Expr* e, const ops::Signature& s);
    Ref random(const ast::Expr* e, const ops::Signature& s);
    Ref told_math(Ref r, Loc at);
    bool returns_early(const ast::FunctionDecl* f);

    // lower_coshaders.cpp
    const std::vector<std::string>* connected(const std::string& parameter) const;
    bool bind_layered(const ast::VarDecl* v, Binding& b);
    void run_layer(int unit);
    void start_layers();
    std::string known_handle(const std::string& handle) const;
    void note_stores();
    std::vector<int> targets(Ref handle);
    std::vector<int> ask_targets(Ref handle);
    void check_targets();
    void for_targets(Ref handle, const std::vector<int>& found, Loc at, const std::function<void(int)>& what);
    void start(int unit);
    std::string unit_name(int unit) const;
    std::string circle(const ast::FunctionDecl* f, int unit) const;
    Ref call_method(int unit, const Linked::Target& target, Loc at);
    Ref coshader(const ast::Expr* e, const std::vector<ast::VarDecl*>* fields = nullptr);
    Ref get_shader(const ast::Expr* e);
    std::vector<std::string> shader_list(const ast::Expr* e);
    std::optional<std::string> plain_text(const ast::Expr* e, const char* what);
    Ref ask_shader(const ast::Expr* e, const ops::Signature& s);

    // lower_material.cpp
    void material(const ast::Expr* e, const ops::Signature& s);
    void add_node(const ast::Expr* e, CallKind kind);
    void set_layer(const ast::Expr* e);
    void set_presence(const ast::Expr* e);
    void set_interior(const ast::Expr* e, CallKind kind);
    // What mnk_init adds, as far as its names are constants.
    struct AddedNodes {
        std::map<std::string, std::set<grid::LobeId>> lobes; // with what they may be
        std::set<std::string> layers;
        std::vector<CallSite> joins; // AddLayer
        bool open = false;           // there are more, whose names only the run time knows
    };
    void note_added(const CallSite& site);
    void check_layers();
    std::string known_nodes(const std::string& name) const;
    bool is_added(const std::string& name, Loc at, std::optional<grid::LobeId> lobe);
    LobeValue lobe_value(const ast::Expr* e);
    void bind_lobe(const ast::VarDecl* v, const ast::Expr* init);
    void set_lobe(const ast::Expr* e);
    void set_channel(const std::string& node, int input, grid::LobeId lobe, Ty ty, Ref value, Loc at);
    int channel(const std::string& node, int input, grid::LobeId lobe, Ty ty, bool presence, Loc at);
    std::string constant_text(const ast::Expr* e, const char* what);
    bool only_in(Role role, const ast::Expr* e, const char* stage);

    // lower_light.cpp: what directions and kernels are, so that illuminance loops and fresnel() can be read
    enum class Tag : uint8_t {
        None,
        View,       // I
        Eye,        // -I
        Facing,     // a normal that faceforward() turned: unturned, since surfaces have two sides
        Behind,     // such a normal the other way round
        Negated,    // any other normal the other way round
        ViewCosine, // I . N
        EyeCosine,  // -I . N
        Mirrored,
        Refracted,
        Light,
        Half,
        LightMirrored,
        Cosine,
        HalfCosine,
        MirrorCosine,
        Ward // a kernel already, times what is known
    };
    Tag tag(Ref r) const {
        const auto it = m_tags.find(r);
        return it == m_tags.end() ? Tag::None : it->second;
    }
    Ref tagged(Ref r, Tag t) {
        if (t != Tag::None)
            m_tags[r] = t;
        return r;
    }
    void store_tagged(int var, Ref value, Loc at);
    Ref load_tagged(int var, Loc at);
    Ref light_direction(Tag t, Loc at);
    Ref kernel(Closure kind, Ty ty, std::vector<Ref> args, Tag t, Loc at);
    static bool is_view(Tag t) { return t == Tag::View || t == Tag::Eye; }
    static Tag side_less(Tag t) { return t == Tag::Negated ? Tag::None : t; }
    Ref light_arithmetic(ast::BinOp op, Ref a, Ref b, Loc at);
    Ref scaled_direction(ast::BinOp op, Ref a, Ref b, Loc at);
    Ref light_cosine(Ref a, Ref b, Loc at);
    Ref side_of_light(bool less, Ref a, Ref b);
    Ref light_shadeop(const ast::Expr* e);
    static const ops::Signature& signature(const ast::Expr* e) {
        return e->shadeop->signatures[size_t(e->signature)];
    }
    std::vector<Ref> arguments(const ast::Expr* e);
    Ref plain_source(const ast::Expr* e, const std::vector<Ref>& args);
    void note_occlusion(Loc at);
    static bool to_light(Tag t);
    Ref normalize(const ast::Expr* e);
    Ref length(const ast::Expr* e);
    Ref face_forward(const ast::Expr* e);
    Ref transform_vector(const ast::Expr* e);
    Ref reflect(const ast::Expr* e, Tag made);
    Ref specular_brdf(const ast::Expr* e);
    Ref exponential(const ast::Expr* e);
    Ref smooth_step(const ast::Expr* e);
    Ref cosine_function(const ast::Expr* e);
    Ref blinn_exponent(Ref roughness, Loc at);
    // lower_kernels.cpp
    bool of_light(Ref r, int depth = 0) const;
    Ref without_cosine(Ref r, Loc at);
    Ref squared_half(Ref r) const;
    struct WardExponent {
        float factor = 0;
        Ref normal = ir::None, X = ir::None, Y = ir::None;
    };
    WardExponent ward_exponent(Ref exponent) const;
    Ref ward(Ref exponent, Loc at);
    Ref ward_arithmetic(ast::BinOp op, Ref a, Ref b, Loc at);
    Ref fresnel(const ast::Expr* e);
    Ref view_direction(Loc at);
    Ref turned(Ref normal, Loc at);
    Ref negated(Ref value, bool normal, Loc at);
    bool depends_on_view(Ref r, std::set<Ref>& seen);
    Ref diffuse(Ref normal, Loc at);
    Ref source_call(const char* shadeop, std::vector<Ref> args, Loc at, Ty result = Ty::Triple);

    // lower_loops.cpp: loops over light, and what else asks for light that comes only later
    struct Cone {
        Ref axis = ir::None, angle = ir::None;
    };
    Cone cone_of(const ast::Stmt* s);
    void illuminance(const ast::Stmt* s);
    Binding bind_color(Loc at);
    void project(const ast::Stmt* s, Loc reason);
    void ask_lights(const ast::Stmt* s);
    void gather(const ast::Stmt* s);
    // `light`: what of it the loop samples, if it does.
    void repeat(const char* counter_name, Ref count, Loc at, const std::function<void(Ref)>& begin,
                const std::function<void()>& body, Ref light = ir::None);
    int reference_value(const char* name, Loc at);
    Ref ray_info(const ast::Expr* e);
    Ref expr_global(const char* name, Loc at);

    bool on_grid() const { return m_role >= Role::Displace; }

    // lower_emission.cpp: light shaders; volume and imager shaders
    void light_stage();
    void filter_stage();
    void emission(const ast::Stmt* s);
    Ref shader_frame(int row, Loc at);
    int m_emission[int(Emission::Count)] = {}; // variables

    static Ty ty(const ast::Type& t);

    Program& m_program;
    Sema& m_sema;
    Diagnostics& m_diagnostics;
    ast::ShaderDecl& m_shader;
    const std::map<int, Loc>& m_projected;
    const Linked* m_linked; // null = no co-shaders are known
    bool m_any_shader;
    std::map<std::string, const std::vector<std::string>*> m_connections; // by parameter
    std::map<std::string, const Connection*> m_layered;                   // those of layers' outputs
    Builder m_b;
    Role m_role = Role::Defaults;
    bool m_said_occlusion = false;
    int m_random = -1; // variable: calls of random() so far, in this run of the stage
    Block* m_prologue = nullptr;
    std::unordered_map<const ast::VarDecl*, Binding> m_bind;
    std::vector<const ast::VarDecl*> m_parameters; // in the order of the program's
    std::unordered_map<const ast::VarDecl*, int> m_parameter_index, m_member_index;
    std::vector<std::pair<const ast::VarDecl*, int>> m_carried; // members, the parameters that carry them
    std::map<std::string, Ref> m_spaces;
    std::unordered_map<int, int> m_channel_vars; // of the stage
    std::map<std::string, int> m_channels;       // by node and input
    AddedNodes m_added;                          // by mnk_init
    std::vector<ast::FunctionDecl*> m_active;
    std::vector<int> m_active_units; // parallel: the co-shaders that they are of, -1 = the shader's own
    int m_self = -1;                 // the co-shader whose code is being lowered
    // Of the stage: co-shaders in use, what they do first, the values that variables get, handles asked for
    std::set<int> m_started;
    std::vector<Item> m_starts;
    size_t m_stores_seen = 0;
    std::map<int, std::vector<Ref>> m_stored;
    std::vector<std::pair<Ref, std::vector<int>>> m_asked;
    bool m_missed = false;
    std::unordered_map<const ast::FunctionDecl*, bool> m_early;
    std::vector<LoopTargets> m_loops;
    struct Return {
        int target, var;
    };
    std::vector<Return> m_returns;
    std::unordered_map<Ref, Tag> m_tags;
    std::unordered_map<int, Tag> m_var_tags;
    int m_illuminance = 0; // depth of illuminance loops that are read as lobes
    int m_loop = -1;       // the illuminance loop being read, and how many there were
    int m_loops_seen = 0;
    Ref m_sample = ir::None; // direction to a light, in a loop that runs over directions
    bool m_lit = false;      // the stage's Ci is read as a material
    int m_loop_depth = 0;    // loops around what is being lowered, functions' callers counted
    int m_trips = 1;         // how often they run it at most, 0 = that is not seen
    int m_known_loops = 0;   // those that m_trips counts
    int m_array_room;        // of arrays that grow in such loops
    struct Push {
        Loc at;
        int var, fault;
    };
    std::vector<Push> m_pushes; // their faults say how much room there is, which is known at the stage's end
    bool m_overflow = false;
};

} // namespace kanuka::sl::ir
