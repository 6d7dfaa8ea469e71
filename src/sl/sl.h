// The shading-language compiler's public face: source text to machine code over grids. LLVM stays inside
// codegen/.
//
//   source ──parse──▶ AST ──sema──▶ typed AST ──ir──▶ IR (uniform/varying, closures extracted) ──codegen──▶
//   native code
//
// A Shader is compiled once and serves all its instances: parameters are data. An Instance is a shader with
// the parameters of one primitive; making it runs mnk_init (or, for a classic surface, the extracted
// closure's structure).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "grid/grid.h"
#include "grid/layering.h"

namespace kanuka::sl {

enum class Type : uint8_t { Float, Color, Point, Vector, Normal, Matrix, String, Shader };
int components(Type type);
std::string_view type_name(Type type);

struct Parameter {
    std::string name;
    Type type = Type::Float;
    bool varying = false;
    bool output = false;
    int array_size = 0;        // 0 = not an array
    bool resizable = false;    // an array of any length; array_size is that of its default value
    std::vector<float> floats; // default value; empty where it is computed at run time
    std::vector<std::string> strings;
    std::string doc; // from "#pragma annotation" or the comment at the declaration
};

enum class ShaderKind : uint8_t { Class, Surface, Displacement, Light, Volume, Imager };
std::string_view kind_name(ShaderKind kind);

// A picture that a shader asks for: a file by name, or the one that a parameter names; neither if it is found
// out while the shader runs.
struct TextureUse {
    std::string file, parameter;
    bool environment = false;
    bool operator==(const TextureUse&) const = default;
};

// Parameters that name co-shaders: those of type shader, and strings that are the handle of one. They are
// known when a shader is compiled with its co-shaders. With an output, the parameter is of any other type,
// and has at each point what the one co-shader, a layer, leaves in that parameter of its own.
struct Connection {
    std::string parameter;
    std::vector<std::string> handles; // of what is not there: null
    std::string output = {};
};

// A shader that another one calls. Its methods are compiled into the caller; its parameters become the
// caller's, "handle.name".
struct CoShader {
    std::string handle;
    std::string file;     // its source, .sl or .slo
    std::string text;     // what the file says, if it need not be read
    std::string category; // for getshaders(), several separated by commas
    std::vector<Connection> connections;
    bool layer = false; // runs once before the shader, on the same Ci, Oi, P and N; layers in their order
};

// Which co-shaders a shader may call: none, those that its parameters name, or any that there is.
enum class CoShaderUse : uint8_t { None, Connected, Any };

struct CompileOptions {
    int lanes = 0;     // 1, 8 or 16 grid points at a time; 0 = the widest this machine runs
    int opt_level = 2; // 0 to 3
    std::vector<std::string> include_path;
    std::vector<std::pair<std::string, std::string>> defines;
    std::string cache_dir; // empty = KANUKA_SHADER_CACHE, else the user's cache folder
    bool use_cache = true;
    // Output parameters of a surface whose values Instance::shade_with_aovs hands out, beside the material.
    // Light is not known while shading: of a colour made of light they have the part without it.
    std::vector<std::string> aovs;
    // A light shader is that of an area light: it runs on the light itself, for points straight in front of
    // it. P and N are those of the grid, Ps lies at P + N.
    bool area_light = false;
    // What a classic surface does that no material can do is an error rather than an approximation with a
    // warning: weights that depend on the viewing direction, functions of light, kernels that are no lobe's.
    bool strict_directions = false;
    // specular(), and specularbrdf(), have Blinn's exponent 1 / roughness, as RISpec has it; else 8 /
    // roughness as PRMan, Aqsis and 3Delight, which nearly all published pictures were made with.
    bool rispec_specular = false;
    // Illuminance loops of classic surfaces that are no lobe's are run for the lights of the scene, at the
    // point that is shaded, without shadows, and what they gather is what the surface shines with. Else they
    // become their albedo.
    bool gathers_light = false;
    // Values that an array has room for that grows in a loop whose length is not seen (reserve() gives more).
    int array_room = 64;
    // What the shader is connected to: its code is made for that. Without it every handle is null.
    std::vector<CoShader> coshaders;
    std::vector<Connection> connections;
};

// ---- services: what a running shader may ask of its surroundings; shade/ implements it
// ------------------------------

struct TextureRequest {
    const char* file;
    const float *s, *t;                     // one per point
    const float *dsdu, *dtdu, *dsdv, *dtdv; // filter footprint: differences to the next grid point
    int count, channels, first_channel;
    float blur, width;
    const char* wrap;  // "periodic", "black", "clamp"; null = the file's own
    const char* space; // that its values are in: "raw", "srgb"; null or "auto" = as the picture says
    float fill;
    float* result; // channels arrays, one after another, `result_stride` floats apart
    int result_stride;
};

// Light of one light at points, without shadows: for volume shaders, which look for it on their way. All in
// current space, three arrays each.
struct LightRequest {
    int light, count;
    const float* P[3];
    float* L[3];  // from the point to the light; a distant one's of length one
    float* Cl[3]; // 0 where it does not shine
};

// What attribute(), option(), rendererinfo() and textureinfo() ask. The answer is a text or floats, as
// wanted.
struct Query {
    enum Kind : uint8_t { Attribute, Option, Renderer, Texture } kind;
    const char* name; // "ShadingRate", "user:age", "Format", "version", "resolution", …
    const char* file; // Texture: which
    bool wants_text;  // else floats, `count` at most
    int count;
    float* floats;
    std::string* text;
};

// Values of a slot that lay outside of its range on one grid, and were taken as its ends.
struct OutOfRange {
    const std::string& shader;
    const grid::Slot& slot;
    float least, most; // of all values that are numbers
    uint64_t count;    // of vertices, or grids where one value is for all; more than rounding
};

class Services {
  public:
    virtual ~Services() = default;
    virtual void texture(const TextureRequest& request) = 0;
    virtual void environment(const TextureRequest& request, const float* x, const float* y,
                             const float* z) = 0;
    // Row-major 4x4, p' = M p with column vectors, that takes points of space `from` to space `to`; "current"
    // is the space of Grid::P. False = unknown.
    virtual bool transform(const char* from, const char* to, float matrix[16]) = 0;
    // False = it is not known, or not of the kind that is wanted.
    virtual bool query(const Query& query) {
        (void)query;
        return false;
    }
    // Lights that shine from somewhere: how many there are, and what one sends to points.
    virtual int lights() { return 0; }
    virtual void light(const LightRequest& request) { (void)request; }
    virtual void out_of_range(const OutOfRange&) {}
    // A run-time fault or message, located in the shader's source.
    virtual void report(Severity severity, const Location& where, const std::string& message) = 0;
};

// ---- running
// ---------------------------------------------------------------------------------------------------------

// A parameter's value: constant for the primitive, or one per grid vertex (a primvar). Two names are no
// parameters but tell of the surroundings: "Os", constant, lets an opaque instance do without a presence
// slot; "Cs" and "Os", varying, that grids carry such primvars (uniform_material() accounts for it).
struct Argument {
    std::string name;
    std::vector<float> floats; // constant: components * max(1, array_size)
    std::vector<std::string> strings;
    bool varying = false; // taken from Grid::primvars by name instead
};

// Values of the surroundings, constant over a grid.
struct GridGlobals {
    Vec3f Cs{1, 1, 1}, Os{1, 1, 1}; // unless the grid has primvars "Cs", "Os"
    Vec3f E{0, 0, 0};               // the eye, in current space; unless a volume shader's grid has "E"
    float time = 0;
    float du = 0, dv = 0; // parameter steps between vertices; on a mesh their mean
};

// What a light shader sends to points, which are the vertices of a grid.
struct Emission {
    // What its last illuminate or solar statement said; none: light from everywhere.
    enum Form : uint8_t { Ambient, Illuminate, Solar, Sky } form = Ambient; // Sky: solar without an axis
    Vec3f from{0, 0, 0};   // illuminate's position, current space
    Vec3f axis{0, 0, 0};   // of the cone; zero = everywhere
    float angle = 0;       // half the cone's opening, radians
    bool uniform = false;  // Cl is the same at all points, whatever they are
    std::vector<float> Cl; // three arrays, the grid's stride apart
};

// What a volume or imager shader makes of colours and opacities: three arrays each, the grid's stride apart.
struct Filtered {
    std::vector<float> Ci, Oi, alpha; // alpha: one array
};

class Shader;

class Instance {
  public:
    virtual ~Instance() = default;
    virtual const Shader& shader() const = 0;
    // Fixed by mnk_init and mnk_interior, which have run.
    virtual const grid::LayeringProgram& program() const = 0;
    virtual bool displaces() const = 0;
    // What displace(), and what all the other stages, read about a vertex.
    virtual grid::Reads reads_displacing() const { return {}; }
    virtual grid::Reads reads_shading() const { return {}; }
    // Run begin and mnk_displacement (or the displacement shader): move P, set N. Thread safe: grids are
    // independent.
    virtual void displace(grid::Grid& grid, const GridGlobals& globals, Services& services) const = 0;
    // Run begin and mnk_prelighting (or the surface shader): fills every slot of program(). May also set N
    // (bump).
    virtual void shade(grid::Grid& grid, const GridGlobals& globals, Services& services,
                       grid::VertexInputs& out) const = 0;
    // Run a light shader with Ps at each vertex of `points`. Thread safe.
    virtual Emission emit(grid::Grid&, const GridGlobals&, Services&) const { return {}; }
    // Run a volume or imager shader: Ci and Oi come in as the grid's primvars "Cs" and "Os" or the globals'
    // (alpha is the first component of Os); P is the place, in an imager that on the raster.
    virtual Filtered filter(grid::Grid&, const GridGlobals&, Services&) const { return {}; }
    // The same, with a value for each name in aovs().
    virtual std::vector<std::string> aovs() const { return {}; }
    virtual void shade_with_aovs(grid::Grid& grid, const GridGlobals& globals, Services& services,
                                 grid::VertexInputs& out, std::vector<grid::SlotValues>& aovs) const {
        aovs.clear();
        shade(grid, globals, services, out);
    }
    // True where no slot varies over a grid, whatever the grid: one point need be shaded.
    virtual bool uniform_material() const = 0;
    // The same for grids that are known to carry, or not to carry, primvars "Cs" and "Os".
    virtual bool uniform_material(bool grids_have_colors) const = 0;
    // Does what the surface sends out of itself vary over such grids?
    virtual bool emission_varies(bool grids_have_colors) const = 0;
};

class Shader {
  public:
    virtual ~Shader() = default;
    virtual const std::string& name() const = 0;
    virtual ShaderKind kind() const = 0;
    virtual std::span<const Parameter> parameters() const = 0;
    virtual uint64_t
    hash() const = 0; // of its source, the compiler's version and the options: part of a grid's key
    virtual bool from_cache() const = 0;
    // True if a stage asks for attributes or options: what it computes may then differ from one primitive to
    // the next.
    virtual bool queries() const { return false; }
    // True if it asks for light between surfaces (indirectdiffuse()) or what keeps it away (occlusion()).
    virtual bool asks_for_interreflection() const { return false; }
    // It has illuminance loops that are no lobe's.
    virtual bool has_light_of_its_own() const { return false; }
    // What it asks for, and may be compiled with (CompileOptions::coshaders).
    virtual CoShaderUse coshaders() const { return CoShaderUse::None; }
    // Unknown arguments and wrong types are reported to the journal (with the names there are) and skipped.
    virtual std::unique_ptr<Instance> instantiate(std::span<const Argument> arguments,
                                                  Services& services) const = 0;
    virtual std::span<const TextureUse> textures() const { return {}; }
    virtual std::vector<std::string> stages() const { return {}; } // those it has, by name
};

// Compiles the first shader of a file (.sl or .slo). On errors: all of them go to the journal, each as
// "file:line:column: what", the source line and a caret below; null is returned. The cache is consulted
// first.
std::shared_ptr<const Shader> compile_file(const std::string& path, const CompileOptions& options,
                                           Journal& journal);
std::shared_ptr<const Shader> compile_source(const std::string& name, const std::string& source,
                                             const CompileOptions& options, Journal& journal);

// ---- publishing, looking
// ---------------------------------------------------------------------------------------------------------

// A .slo's bytes: the preprocessed source, to be compiled anywhere. Nothing if it does not compile.
std::optional<std::string> publish(const std::string& name, const std::string& source,
                                   const CompileOptions& options, Journal& journal);
// What a .slo says of itself (JSON), without compiling. Throws Error if it is damaged or none.
std::string published_metadata(const std::string& name, std::string_view bytes);

// What becomes of a shader: the preprocessed source, the checked tree, the optimised intermediate
// representation, the same as C would say it, LLVM's, machine code.
enum class Emit : uint8_t { Rsl, Ast, Ir, C, Llvm, Asm };
inline constexpr std::string_view EmitNames[] = {"rsl", "ast", "ir", "c", "llvm", "asm"};
// Names for emit() of the stages that a shader may have.
std::vector<std::string> emit_stages();
// Text for people, nothing if the shader does not compile. `stage` "" = all of them.
std::optional<std::string> emit(const std::string& name, const std::string& source, Emit what,
                                const std::string& stage, const CompileOptions& options, Journal& journal);

// Do a file's first bytes say that it is a published shader? (slo.h; ".slo" is the name of other renderers'
// compiled shaders, too.)
bool is_slo(std::string_view bytes);

// ---- the cache
// ---------------------------------------------------------------------------------------------------------

std::string default_cache_dir();
uint64_t cache_limit(); // bytes; KANUKA_SHADER_CACHE_SIZE, as 500M or 2G, or 1 GiB

struct CacheEntry {
    std::string file, shader, key;
    uint64_t bytes = 0;
    double age_s = 0;    // since its last use
    std::string problem; // what is wrong with it; only if it was asked for
};
std::vector<CacheEntry> cache_entries(const std::string& folder, bool verify); // newest first
uint64_t cache_clear(const std::string& folder);                               // number of files removed
uint64_t cache_trim(const std::string& folder, uint64_t max_bytes);

inline constexpr int CompilerVersion = 9;

} // namespace kanuka::sl
