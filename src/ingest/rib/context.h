// Executes Ri requests: keeps the graphics state and fills the scene. The RIB reader and the C binding drive
// it alike.
#pragma once

#include "ingest/rib/call.h"
#include "ingest/rib/declarations.h"
#include "ingest/rib/lights.h"
#include "ingest/rib/objects.h"
#include "ingest/rib/programs.h"
#include "ingest/rib/reports.h"
#include "ingest/rib/requests.h"
#include "ingest/rib/rib.h"
#include "ingest/rib/state.h"
#include "scene/editor.h"

namespace kanuka::ingest {

// What requests that change the flow of requests need of whoever makes the calls.
class Stream {
  public:
    virtual ~Stream() = default;
    virtual void read_archive(const std::string& name, const Location& where) = 0;
    // RIB that was made on the way; `name` is what messages call it.
    virtual void read_text(std::string text, const std::string& name, const Location& where) = 0;
    // Passes over requests up to the next of `stops` that is not nested in a block opened by `begin`; it is
    // executed next. Declarations on the way count.
    virtual void skip_to(std::string_view begin, std::initializer_list<std::string_view> stops) = 0;
    // Remembers the requests up to ArchiveEnd under a name.
    virtual void record_archive(const std::string& name) = 0;
    virtual void stop() = 0;
    virtual double progress() const { return 1; } // how much of the outermost file has been read, 0 to 1
    virtual std::string folder() const = 0;       // of the file being read; empty = the working directory
};

// The samples of an open motion block.
struct MotionBlock {
    std::vector<double> times;
    Location where;
    const RequestSpec* request = nullptr; // of all samples
    int calls = 0;
    bool wrong_times = false; // reported: the first sample is all there is
    // Of a transformation: its own matrix at every time; `absolute` if it replaces what was there.
    std::vector<TransformKey> local;
    bool absolute = false;
    std::vector<std::array<double, 4>> turns; // of Rotate: angle and axis
    // Of a primitive: where it went (the object or -1 for the world, its index; none = it was left out), its
    // shapes.
    int object = -1, index = -1;
    std::vector<scene::Motion::Shape> shapes;
    // Of any other request: they have a mean.
    std::vector<Call> samples;
};

// A request before the world whose samples were replaced by their mean over the shutter, which may change
// yet.
struct MeanOverShutter {
    std::vector<double> times;
    std::vector<Call> samples;
    std::vector<double> weights;
    Rgb color, opacity; // as they were set then
};

// Attributes that Resource "attributes" saved.
struct Resource {
    AttributeState attributes;
    Transform ctm;
    std::vector<TransformKey> ctm_keys;
};

struct RibFrame;

struct FrameChoice {
    int frame = 0; // FrameBegin's number; 0 = the first that makes a picture
    bool take_depth_pass =
        false; // a frame that writes depth, or a texture's picture, alone counts as a picture
    const std::set<std::string, std::less<>>* sources = nullptr; // pictures that textures are made of
    std::vector<RibFrame>* list = nullptr;                       // all are noted there, and none is taken
    int repeat = 0;                                              // frames of that number to pass over
    bool camera_only = false;                                    // reading ends where the world begins
};

class OnDemand;

class Context {
  public:
    Context(Stream& stream, Declarations& declarations, Journal& journal, FrameChoice frame,
            std::string scene_folder, std::vector<std::string> extra_archive_path);

    void execute(Call& call);
    void finish(const Location& end); // closes what is open and completes the scene
    scene::Scene& scene() { return m_scene; }
    // For programs that make several pictures: the world just ended, and the next WorldBegin begins anew.
    // None where the world was passed over.
    std::optional<scene::Scene> take_world();
    bool world_done() const { return m_world_done; }
    bool world_in_frame() const { return m_world_in_frame; } // the one that was taken
    // The file asks for what RISpec's renderers did not do: networks of shaders since RenderMan 19, area
    // lights.
    bool traces_light = false;
    // Requests are a program's and no file's: what stands outside of a world is said where it stands.
    bool of_program = false;
    bool depth_pass_skipped() const { return !m_depth_passes.empty(); }
    const std::vector<int>& frames_seen() const { return m_frames_seen; }
    int left_outside() const { return m_outside; } // requests for a world, in a file that has none

    // ---- for handlers -------------------------------------------------------------------------------
    Reports reports;
    Stream& stream;
    Declarations& declarations;
    OptionState options;
    AttributeState attributes;
    // camera_from_current before WorldBegin, world_from_current after it, object_from_current in objects.
    Transform ctm;
    std::vector<TransformKey> ctm_keys; // of a moving one, which `ctm` starts with; empty = it stands still
    Lights lights;
    Objects objects;
    std::map<std::string, Transform> coordinate_systems;
    std::map<std::string, scene::ShaderRef> patterns;          // Pattern, by handle
    std::map<std::string, std::optional<Rgb>> light_filters;   // LightFilter: a factor; none = reported
    std::vector<std::map<std::string, Resource>> resources{1}; // Resource "attributes", by open ResourceBegin
    std::vector<bool> conditions;                              // of open IfBegin blocks: a branch was taken
    std::vector<std::string> default_path; // what "@" means in search paths, and "&" at first
    const std::vector<std::string> extra_archive_path;
    RibOptions rib_options; // set by whoever makes the context
    Programs programs;
    size_t procedurals = 0;      // expanded so far
    OnDemand* delayed = nullptr; // where those go that can wait; null = they are expanded at once
    // Where nothing around a procedural ties it to its place in the file.
    bool may_delay() const;
    // What stands in a world that has ended already: requests from here on make a scene of their own, whose
    // groups are numbered on.
    void reopen_world();
    scene::Scene close_world();
    // It is being read: what it makes is named under it.
    void begin_delayed(scene::NodeId procedural);

    Scope scope() const;
    bool in_world() const { return m_in_world; }
    const std::vector<Block>& blocks() const { return m_blocks; }
    std::vector<scene::Solid>& solids() { // of the world or the open object
        return m_open_object >= 0 ? objects.record(m_open_object).solids : m_scene.solids;
    }
    int add_solid(scene::Solid solid); // its index there
    // A light that shines on everything: in the world, or where the object that is open will be instanced.
    void add_light(scene::ShaderRef light);
    std::vector<AttributeState*> open_states(); // the current one, and what closing blocks return to
    void open(BlockKind kind, const Location& where);
    // Closes the innermost open block of a kind, and what was left open inside it. False: there is none to
    // close.
    bool close(BlockKind kind, const Location& where);
    void begin_frame(int number, const Location& where);
    void end_frame(const Location& where);
    void begin_world(const Location& where);
    void end_world(const Location& where);
    void begin_object(const std::string& handle, const Location& where);
    void end_object(const Location& where);
    void begin_motion(const Call& call);
    void end_motion(const Location& where);

    // camera_from_current: what handedness and level of detail are measured by.
    Transform camera_from_current() const;
    Transform world_from_current() const; // in a world
    bool left_handed() const { return camera_from_current().determinant3() >= 0; }
    scene::ShaderRef shader(Call& call, size_t name_argument) const;
    // Checks the primvars against the geometry and adds the primitive to the world or the open object.
    void add_primitive(Call& call, scene::Geometry geometry);
    void add_instance(const Call& call);
    // Scales, positions, matrices: a NaN or infinity would spread. Reported; false = leave the call out.
    bool finite(const Call& call, size_t arguments);
    // Transformations: ctm' = ctm * t at all times, and ctm' = t.
    void concat(const Transform& t);
    void replace(const Transform& t);

  private:
    bool usable_transform(const Call& call);
    const Shared<Transform>& shared_ctm();
    static constexpr size_t MostInSolid = 1'000'000;
    struct SolidInstance;
    void add_to_solid(int object, const Location& where);
    bool expand(const SolidInstance& instance, size_t& left); // false: it is too much
    void add_shape(Call& call, scene::Geometry geometry);
    void motion_sample(Call& call);
    void finish_motion();
    void finish_mean(std::vector<double> times, std::vector<Call> samples); // motion_mean.cpp
    std::vector<double> weights_of(std::span<const double> times) const;
    void mend_means();
    void complete();
    void restore(Block& block);
    void tell_of_outside();
    bool is_asked_for(int number) const;
    int repeats() const;
    bool writes_depth_only() const;
    bool writes_sources() const;
    void choose_camera(const Location& where);
    bool takes_world(int number, const Location& where);
    Transform set_camera(const Location& where);

    scene::Scene m_scene;
    std::optional<scene::Editor> m_editor{m_scene}; // of m_scene, always
    FrameChoice m_frame_choice;
    std::vector<Block> m_blocks;
    bool m_in_world = false, m_world_done = false, m_world_in_frame = false;
    std::vector<std::pair<int, Location>> m_depth_passes; // passed over: frame and place
    bool m_frame_open = false, m_frame_chosen = false;
    int m_frames_begun = 0, m_loose_worlds = 0;
    int m_outside = 0; // requests before the first world that belong into one
    std::pair<std::string, Location> m_first_outside;
    std::vector<int> m_frames_seen;
    Location m_world_where;
    OptionState m_world_options; // what is read when the world has ended needs them too
    Transform m_camera_from_world;
    size_t m_frame_lights = 0, m_lights_before = 0;
    int m_next_id = 1;
    Shared<Transform> m_shared_ctm; // of the primitive before
    int m_open_object = -1;
    Transform m_object_outer; // the transformation at ObjectBegin
    MotionBlock m_motion;     // the open one: they do not nest
    std::vector<MeanOverShutter> m_means;
};

} // namespace kanuka::ingest
