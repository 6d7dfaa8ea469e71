#include "sl/ir/lower.h"

#include "sl/ir/lower/arrays.h"
#include "sl/ir/lower/assignments.h"
#include "sl/ir/lower/coshaders.h"
#include "sl/ir/lower/directions.h"
#include "sl/ir/lower/emission.h"
#include "sl/ir/lower/expressions.h"
#include "sl/ir/lower/functions.h"
#include "sl/ir/lower/handles.h"
#include "sl/ir/lower/light_loops.h"
#include "sl/ir/lower/materials.h"
#include "sl/ir/lower/members.h"
#include "sl/ir/lower/optics.h"
#include "sl/ir/lower/parameters.h"
#include "sl/ir/lower/program.h"
#include "sl/ir/lower/queries.h"
#include "sl/ir/lower/shadeops.h"
#include "sl/ir/lower/splines.h"
#include "sl/ir/lower/statements.h"
#include "sl/ir/lower/textures.h"
#include "sl/ir/lower/variables.h"
#include "sl/ir/lower/ward.h"

namespace kanuka::sl::ir {

namespace {

// All parts of one lowering.
struct Lowerers {
    explicit Lowerers(LowerContext& c)
        : program(c), parameters(c), members(c), variables(c), assignments(c), expressions(c), statements(c),
          functions(c), shadeops(c), textures(c), queries(c), arrays(c), splines(c), materials(c),
          directions(c), optics(c), ward(c), light_loops(c), tracker(c), coshaders(c), emission(c) {
        c.parameters = &parameters;
        c.members = &members;
        c.variables = &variables;
        c.assignments = &assignments;
        c.expressions = &expressions;
        c.statements = &statements;
        c.functions = &functions;
        c.shadeops = &shadeops;
        c.textures = &textures;
        c.queries = &queries;
        c.arrays = &arrays;
        c.splines = &splines;
        c.materials = &materials;
        c.directions = &directions;
        c.optics = &optics;
        c.ward = &ward;
        c.light_loops = &light_loops;
        c.tracker = &tracker;
        c.coshaders = &coshaders;
        c.emission = &emission;
    }

    ProgramLowerer program;
    ParameterLowerer parameters;
    MemberLowerer members;
    VariableLowerer variables;
    AssignmentLowerer assignments;
    ExpressionLowerer expressions;
    StatementLowerer statements;
    FunctionLowerer functions;
    ShadeopLowerer shadeops;
    TextureLowerer textures;
    QueryLowerer queries;
    ArrayLowerer arrays;
    SplineLowerer splines;
    MaterialLowerer materials;
    DirectionLowerer directions;
    OpticsLowerer optics;
    WardLowerer ward;
    LightLoopLowerer light_loops;
    HandleTracker tracker;
    CoshaderLowerer coshaders;
    EmissionLowerer emission;
};

} // namespace

LowerResult lower(Program& program, Sema& sema, Diagnostics& diagnostics, ast::ShaderDecl& shader,
                  const LowerOptions& options) {
    LowerContext context{
        program, sema, diagnostics, shader, options, sema.linked(), Builder(program.defaults)};
    Lowerers lowerers(context);
    lowerers.program.run();
    return {lowerers.tracker.missed()};
}

} // namespace kanuka::sl::ir
