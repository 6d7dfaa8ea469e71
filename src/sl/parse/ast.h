// The syntax tree. The parser fills in what was written; sema adds what it means (types, declarations).
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "grid/lobe_schema.h"
#include "sl/parse/source.h"
#include "sl/sl.h"

namespace kanuka::sl::ops {
struct Shadeop;
}

namespace kanuka::sl::ast {

enum class Base : uint8_t {
    Error, // of an expression that was already complained about
    Void,
    Bool,
    Float,
    Color,
    Point,
    Vector,
    Normal,
    Matrix,
    String,
    Shader, // a co-shader's handle
    Struct,
    Lobe,
    Material,
    Boundary,
    Interior,
    ObjectProperties,
};

constexpr Base base_of(grid::InputType type) {
    return type == grid::InputType::Float   ? Base::Float
           : type == grid::InputType::Color ? Base::Color
                                            : Base::Normal;
}

struct StructDecl;

struct Type {
    Base base = Base::Error;
    bool array = false;
    int size = 0;                                  // of an array; 0 = as long as what is bound to it
    grid::LobeId lobe = grid::LobeId::LambertBrdf; // of Base::Lobe
    const StructDecl* record = nullptr;            // of Base::Struct

    bool operator==(const Type& o) const {
        return base == o.base && array == o.array && (base != Base::Lobe || lobe == o.lobe) &&
               (base != Base::Struct || same_struct(o));
    }
    bool same_struct(const Type& o) const; // co-shaders include the same headers
    bool is(Base b) const { return base == b && !array; }
    bool triple() const { return base >= Base::Color && base <= Base::Normal && !array; }
    bool spatial() const { return base >= Base::Point && base <= Base::Normal && !array; }
    bool numeric() const { return base >= Base::Bool && base <= Base::Matrix && !array; }
    bool handle() const { return base >= Base::Material; }
    std::string str() const;
};

enum class Detail : uint8_t { Unspecified, Uniform, Varying };

struct Expr;
struct Stmt;
struct FunctionDecl;

struct VarDecl {
    enum Kind : uint8_t { Local, Formal, Parameter, Member, Global };
    std::string_view name;
    Loc loc;
    Kind kind = Local;
    Type type;
    Detail detail = Detail::Unspecified;
    bool output = false;
    bool is_extern = false;
    Expr* size = nullptr; // the array's, as written
    Expr* init = nullptr;
    int global = -1; // index into ops::globals()
    std::string doc;
    // sema
    bool read = false, written = false, internal = false;
    bool assigned = false;        // by an assignment or as an output argument, not by its initial value
    bool resizable = false;       // an array whose length is a value of its own
    int capacity = 0;             // of a resizable array: elements that its uses ask for
    std::vector<VarDecl*> fields; // of a struct: a variable for each member
};

// struct Name { type member = value; … }
struct StructDecl {
    std::string_view name;
    Loc loc;
    std::vector<VarDecl*> members;
    std::vector<FunctionDecl*> functions; // they see the members as variables
};

enum class ExprKind : uint8_t {
    Number,
    String,
    Name,     // text
    Index,    // args: array, index
    Call,     // text, args
    Method,   // args[0] -> text, or with `called` -> text (args[1…])
    Sequence, // a, b, …: the value of the last
    Cast,     // to `type`, in space args[1] if there are two
    Tuple,    // args: 3 or 16 components
    TupleIn,  // args: space, components…: color "hsv" (h, s, v)
    List,     // { … }
    Unary,    // op: - !
    Binary,   // op
    Ternary,
    Assign,   // op: = += …
    Construct // a lobe, args: name, value, …; or a struct, args: its members' values in order
};

enum class BinOp : uint8_t { Add, Sub, Mul, Div, Dot, Cross, Lt, Le, Gt, Ge, Eq, Ne, And, Or, None };
std::string_view spelling(BinOp op);

struct Expr {
    ExprKind kind;
    Loc loc;
    BinOp op = BinOp::None; // Binary and compound Assign; None = plain assignment
    bool negate = false;    // Unary: - rather than !
    bool called = false;    // Method: with parentheses
    float number = 0;
    std::string_view text;
    std::vector<Expr*> args;
    Type type;                           // Cast, Tuple: as written; else by sema
    Detail detail = Detail::Unspecified; // Cast: as written
    // sema
    VarDecl* var = nullptr;
    FunctionDecl* function = nullptr;
    const ops::Shadeop* shadeop = nullptr;
    int signature = -1; // of the shadeop
};

enum class StmtKind : uint8_t {
    Empty,
    Block,
    Declare,
    Expression,
    If,          // expr, body, orelse
    While,       // expr, body
    For,         // init, expr, step, body
    Break,       // levels
    Continue,    // levels
    Return,      // expr or null
    Illuminance, // args, body
    Illuminate,
    Solar,
    Gather,   // args, body (a ray hits), orelse (it does not)
    Function, // nested
};

struct Stmt {
    StmtKind kind;
    Loc loc;
    Expr* expr = nullptr;
    Expr* init = nullptr;
    Expr* step = nullptr;
    Stmt* first = nullptr; // For: a declaration as initialisation
    Stmt* body = nullptr;
    Stmt* orelse = nullptr;
    int levels = 1;
    std::vector<Stmt*> block;
    std::vector<VarDecl*> vars;
    std::vector<Expr*> args;
    FunctionDecl* function = nullptr;
};

struct FunctionDecl {
    std::string_view name;
    Loc loc;
    Type result;
    std::vector<VarDecl*> formals;
    Stmt* body = nullptr;
    bool is_public = false;
    // sema
    enum { Unchecked, Checking, Checked } state = Unchecked;
    FunctionDecl* outer = nullptr;
    VarDecl* result_fields = nullptr; // of a function that returns a struct: where it is left
    bool called = false;
    void* scope = nullptr; // sema: where its name lookups start
};

struct ShaderDecl {
    ShaderKind kind = ShaderKind::Surface;
    std::string_view name;
    Loc loc;
    std::vector<VarDecl*> parameters;
    std::vector<VarDecl*> members;        // class
    std::vector<VarDecl*> constants;      // declared outside of shaders
    std::vector<FunctionDecl*> functions; // class: methods and functions
    Stmt* body = nullptr;                 // classic
};

inline bool Type::same_struct(const Type& o) const {
    return record == o.record || (record && o.record && record->name == o.record->name &&
                                  record->members.size() == o.record->members.size());
}

// Owns all nodes of a compilation.
class Arena {
  public:
    Expr* expr(ExprKind kind, Loc loc) { return &m_exprs.emplace_back(Expr{kind, loc}); }
    Stmt* stmt(StmtKind kind, Loc loc) { return &m_stmts.emplace_back(Stmt{kind, loc}); }
    VarDecl* var() { return &m_vars.emplace_back(); }
    FunctionDecl* function() { return &m_functions.emplace_back(); }
    ShaderDecl* shader() { return &m_shaders.emplace_back(); }
    StructDecl* record() { return &m_structs.emplace_back(); }

  private:
    std::deque<Expr> m_exprs;
    std::deque<Stmt> m_stmts;
    std::deque<VarDecl> m_vars;
    std::deque<FunctionDecl> m_functions;
    std::deque<ShaderDecl> m_shaders;
    std::deque<StructDecl> m_structs;
};

struct Unit {
    std::vector<FunctionDecl*> functions;
    std::vector<ShaderDecl*> shaders;
    std::vector<VarDecl*> constants; // declared outside of shaders
    bool plugins = false;            // plugin "name"; functions from elsewhere
};

} // namespace kanuka::sl::ast
