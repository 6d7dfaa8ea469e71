// A Material: shader instances that many primitives share, and what is one primitive's own.
#pragma once

#include <memory>

#include "shade/primvar_aovs.h"
#include "shade/services.h"
#include "shade/shade.h"
#include "sl/sl.h"

namespace kanuka::shade {

// What all primitives of equal shaders and parameters share.
struct MaterialCore {
    std::shared_ptr<const sl::Shader> surface_shader, displacement_shader,
        area_light_shader; // keep the instances' code alive
    std::unique_ptr<sl::Instance> surface, displacement,
        area_light;                // null = none of its own; surface is never
    grid::LayeringProgram program; // the surface's, with emission and presence added
    int emission_slot = -1;        // of the area light's radiance
    Rgb emission{0, 0, 0};
    bool light_varies = false; // that radiance does, over the light
    SpacesRead read;           // while it was made
    Digest of_read;            // the values of that
    bool shared = true;        // false: attributes of one primitive decided what it is
    int presence_slot =
        -1; // of Attributes::opacity; -1 where the shader computes presence itself, or it is one
    size_t surface_aovs = 0;         // of program.aovs; the others are variables of primitives
    std::vector<bool> wanted_lights; // those that cast no shadows, where program.lit_by has the others
    std::shared_ptr<Ranges> ranges;  // what its values are told to that are out of range
    std::string key;
};

// Adds a float slot for each component of the output parameters that are handed out.
void add_aovs(grid::LayeringProgram& program, const sl::Instance& surface,
              const std::vector<std::string>& wanted);

// Adds a slot for what the surface shines with by each light that casts shadows: lights[i] does.
void add_lit_by(grid::LayeringProgram& program, const std::vector<bool>& lights);

// Adds a DiffuseEmission lobe beside all of the program's: emission is added, the surface keeps what it
// reflects.
//      Add
//     /   \      upper: the emission, lower: the surface as it was
// Returns the slot of its radiance.
int add_emission(grid::LayeringProgram& program);

class MaterialImpl final : public Material {
  public:
    struct Own {
        Spaces spaces;
        Rgb color{1, 1, 1}, opacity{1, 1, 1};
        Rgb emission{0, 0, 0}; // of an area light
        bool varying_color_or_opacity = false;
        Transform displacement_from_shader; // current_from_shader of the displacement shader
        Transform area_light_from_shader;
        Location surface_where, displacement_where, area_light_where;
        std::shared_ptr<const scene::Attributes> attributes; // keeps what facts point at
        Facts facts;
        std::vector<PrimvarAov> primvar_aovs;           // those that the surface does not hand out
        Digest digest_of(const SpacesRead& read) const; // by any of its shaders
    };
    MaterialImpl(std::shared_ptr<const MaterialCore> core, Own own, Textures& textures, Journal& journal,
                 uint64_t hash);

    const grid::LayeringProgram& program() const override { return m_core->program; }
    bool displaces() const override;
    bool emission_varies() const override;
    grid::Reads reads_displacing() const override;
    grid::Reads reads_shading() const override;
    bool uniform() const override;
    uint64_t hash() const override { return m_hash; }
    SpacesRead reads_spaces() const override;
    Digest digest_of(const SpacesRead& read) const override;
    using Material::displace, Material::shade;
    void displace(grid::Grid& grid, SpacesLog* log) const override;
    void shade(grid::Grid& grid, grid::VertexInputs& out, SpacesLog* log) const override;

  private:
    sl::GridGlobals globals(const grid::Grid& grid) const;
    void shade_by_lights(grid::Grid& grid, const sl::GridGlobals& globals, MaterialServices& services,
                         grid::VertexInputs& out) const;

    std::shared_ptr<const MaterialCore> m_core;
    Own m_own;
    Textures& m_textures;
    Journal& m_journal;
    uint64_t m_hash;
    Vec3f m_eye;
};

} // namespace kanuka::shade
