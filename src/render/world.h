// All until rays can be traced: colours, shaders, pages, groups, the hierarchy; and what is added to it when
// rays have met procedurals.
#pragma once

#include "render/color_setup.h"
#include "render/geometry.h"
#include "render/job.h"
#include "render/on_demand.h"

namespace kanuka::render {

// What outlives a making of the scene, so that the next one makes again only what an edit has touched.
struct Kept {
    explicit Kept(bool keeps_pages) : pages(keeps_pages) {}
    PageCache pages;
    std::set<scene::NodeId> met; // procedurals that rays of a shot's frames have met
    MadeAgain made_again;
    ColorSetup color; // pages name its spectra by number
    Digest of_color;
    std::unique_ptr<Geometry> geometry;
    std::unique_ptr<bvh::Scene> bvh;
    Digest of_bvh; // of the geometry, and how it was built; null = none is kept
};

class World {
  public:
    // `kept`: null = nothing is kept, and nothing has a key.
    World(Job& job, Kept* kept);
    ~World(); // what can be of use again goes to `kept`

    void build();
    void build_surfaces(); // all of it but the hierarchy
    // Waits until all that the store is to have is written, while rays are traced, and tells what could not
    // be.
    void close_store();
    // Reads what rays have met since the last call. True: there is more to be traced now.
    bool extend();

    const PlacedCamera& camera() const { return m_camera; }
    const ColorSetup& color() const { return m_kept->color; }
    shade::ShadingSystem& shading() { return *m_shading; }
    const Linking& linking() const { return *m_linking; }
    const Geometry& geometry() const { return *m_geometry; }
    const bvh::Scene& bvh() const { return *m_bvh; }
    // To record footprints of this world's primitives.
    std::unique_ptr<OracleRecorder> recorder() const;
    const OnDemand* on_demand() const { return m_on_demand.get(); }
    bool classic() const { return m_classic; } // scene::Options::transport, decided
    Bounds3f bounds() const;                   // in world space
    // What rays have met is read at once by the frames after. Not where its memory is limited: there each
    // frame has room for its own.
    bool reads_ahead() const { return m_on_demand && !m_job.shot.empty() && m_on_demand->limit() == 0; }
    // Of all that the geometry was made of, where it is kept.
    Digest key() const { return m_geometry->key; }

  private:
    void place_camera();
    std::vector<Transform> poses_of_shot() const;
    float finest_rate() const;
    void prepare_color();
    void decide_transport();
    GeometryRequest request_for(const scene::Scene& scene);
    void build_bvh();
    void drop_what_leaves_no_room();
    void bound_nesting();
    void number_emitters();
    uint64_t resident_bytes() const;
    uint64_t add_part(const scene::Scene& part);

    Job& m_job;
    Kept m_own{false}; // where none is given
    Kept* m_kept;
    const bool m_has_keys;
    PlacedCamera m_camera;
    dice::DiceOptions m_dice;
    bool m_classic = false;
    std::unique_ptr<shade::ShadingSystem> m_shading;
    std::unique_ptr<Linking> m_linking;
    std::vector<bvh::Scene::Plane> m_clips;
    std::unique_ptr<store::DiskStore> m_disk;
    std::optional<DicingOracle> m_oracle;
    std::unique_ptr<Geometry> m_geometry;
    std::unique_ptr<OnDemand> m_on_demand;
    std::unique_ptr<bvh::Scene> m_bvh;
    Digest m_of_bvh;
};

} // namespace kanuka::render
