// Runs compiled shaders over grids: binds a primitive's attributes and primvars to a shader instance, serves
// textures.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/stats.h"
#include "base/vec.h"
#include "color/palette.h"
#include "color/spaces.h"
#include "grid/air.h"
#include "grid/grid.h"
#include "grid/layering.h"
#include "scene/scene.h"
#include "shade/spaces.h"

namespace kanuka::sl {
struct LightRequest;
}

namespace kanuka::shade {

struct ShadingOptions {
    std::vector<std::string> shader_path,
        texture_path;                        // folders, in order; then the folder of the scene file
    std::string standard_shaders;            // folder of the shaders that ship with Kanuka
    std::string cache_dir;                   // empty = default
    int lanes = 0;                           // 0 = widest
    size_t texture_bytes = size_t(1) << 30;  // memory for texture tiles
    color::Palette* palette = nullptr;       // takes the measured spectra that materials name; must outlive
    const scene::Options* options = nullptr; // of this render; null = the scene's
    const scene::Camera* camera = nullptr;
    Transform render_from_world; // "world" and "camera" spaces for shaders
    Transform camera_from_render;
    std::vector<std::string> aovs; // what displays ask for: programs have it where their surface has such an
                                   // output parameter, or their primitive such a variable
};

// What one primitive looks like: its surface and displacement shaders with parameters bound. A shader that is
// missing or does not compile is reported and replaced by matte, as RISpec asks. Thread safety: displace and
// shade may run on many grids at once.
class Material {
  public:
    virtual ~Material() = default;
    virtual const grid::LayeringProgram& program() const = 0;
    virtual bool displaces() const = 0;
    virtual bool emission_varies() const { return false; } // over its surface
    // What displace() and shade() read about a vertex. Of a mesh they take patches that have so many rings
    // of neighbours (grid/mesh_patches.h).
    virtual grid::Reads reads_displacing() const { return {}; }
    virtual grid::Reads reads_shading() const { return {}; }
    virtual bool uniform() const = 0; // no input varies over a grid: shade one vertex
    virtual uint64_t
    hash() const = 0; // shader objects and parameters, not where it stands; part of a page's key
    // What it reads in any case of where the primitive stands; a log of displace() and shade() tells the
    // rest. With the values of all this, here, a page's key is complete.
    virtual SpacesRead reads_spaces() const { return {}; }
    virtual Digest digest_of(const SpacesRead&) const { return {}; }
    // `log`: null = nobody wants to know.
    virtual void displace(grid::Grid& grid, SpacesLog* log) const = 0;
    virtual void shade(grid::Grid& grid, grid::VertexInputs& out, SpacesLog* log) const = 0;
    void displace(grid::Grid& grid) const { displace(grid, nullptr); }
    void shade(grid::Grid& grid, grid::VertexInputs& out) const { shade(grid, out, nullptr); }
};

// Pixels that an imager shader changes: row by row, x0 and y0 are the first one's place on the raster.
struct ImagerPixels {
    int width, height, x0, y0;
    int full_width, full_height;     // of the raster
    std::span<float> r, g, b, alpha; // one value a pixel
};

// What a volume shader knows of light by rays, while it runs for some segments. Point i of a request lies on
// segment i modulo their number.
class AirLights {
  public:
    virtual ~AirLights() = default;
    // What is in the way of a light of ShadingSystem::lamps(): scales Cl. `far`: L has no length.
    virtual void dim(const sl::LightRequest& request, bool far) = 0;
    // Lights that are asked at a place of theirs at a time, and how many there are: fills in L and Cl.
    virtual int wide() const = 0;
    virtual void ask(const sl::LightRequest& request) = 0;
};

// A light that shines from one place, as shaders are told of it: those of its kind that the scene has, by
// number. `place`: in world space; far: the direction to it.
struct Lamp {
    scene::Light light;
    Vec3f place{0, 0, 0};
    bool far = false;
};

class ShadingSystem {
  public:
    static std::unique_ptr<ShadingSystem> create(const ShadingOptions& options, const scene::Scene& scene,
                                                 Journal& journal, Stats& stats);
    virtual ~ShadingSystem() = default;
    // "current" is the space that grids come in. Primvars of constant detail are bound as parameters; varying
    // ones are found on the grid. Materials are shared where all they depend on is equal. For primitives of a
    // group, its space stands for the world's: it may be seen from many places at once.
    // `variants`: variables that instances bring, once for each variant that is shaded; none: it has those of
    // its attributes. Variables of its own count more.
    virtual std::shared_ptr<const Material> material(const scene::Primitive& primitive,
                                                     const Transform& current_from_object,
                                                     const Transform& current_from_world,
                                                     std::span<const scene::ValueList> variants = {}) = 0;
    // Does its surface shader, or a co-shader of that, read a variable of this name?
    virtual bool surface_reads(const scene::Primitive& primitive, std::string_view name) = 0;
    // Is all of it what RISpec's renderers knew? Surfaces by classic shaders, or none (those that are missing
    // count as classic); lights of RISpec's four kinds, or by shaders of the scene.
    virtual bool all_classic(const scene::Scene& scene) = 0;
    // Primitives that name no surface are lit from the eye, by no light, as RISpec's renderers had it; else
    // they are matte. Before any material is asked for.
    virtual void light_defaults_from_eye() = 0;
    // Tells what materials gave so far that lay outside of the ranges of lobes' inputs. After shading.
    virtual void report_ranges() {}
    virtual bool knows(const scene::ShaderRef& shader) const = 0; // its file is found
    // Light shaders to lights. The standard ones (ambientlight, distantlight, pointlight, spotlight) and
    // Kanuka's own environmentlight are analytic; any other is run and tabulated (light_table.h). `lit`:
    // bounds in world space of what there is to be lit.
    virtual std::vector<scene::Light> lights(const std::vector<scene::ShaderRef>& shaders,
                                             const Bounds3f& lit) = 0;
    // Looks for the files that a light names along the texture path; one that is missing is reported and left
    // out.
    virtual void find_files(scene::Light& light) = 0;
    // Runs an imager shader; one that is missing or does not compile is reported and changes nothing.
    virtual void image(const scene::ShaderRef& imager, const ImagerPixels& pixels) = 0;
    // Air, by LayeringProgram::air: of the atmospheres of all materials so far. Thread safe.
    virtual void evaluate(int air, grid::AirSegments& segments, AirLights& lights) = 0;
    virtual void check_air(const Bounds3f& seen) = 0; // reports what is no filter; `seen`: in render space
    virtual bool has_air() const = 0;
    virtual std::vector<Lamp> lamps() = 0; // also those of LayeringProgram::lit_by
    virtual uint64_t texture_bytes() const = 0;
    virtual uint64_t textures_made() const = 0; // of plain pictures, for this render and later ones
};

// A whole environment picture, linear, row by row from the top; base/latlong.h says where it shows what.
struct LatLong {
    int width = 0, height = 0;
    std::vector<float> rgb;
};
// At most `max_width` wide, averaged where the file is larger; 0 = as it is. Pictures of 8 and 16 bits, which
// are sRGB's, are brought to `space`; all others are in it already. None = reported for `asker`.
std::optional<LatLong> read_latlong(const std::string& file, color::Space space, int max_width,
                                    const Location& asker, Journal& journal);

} // namespace kanuka::shade
