// Sessions drive the whole way: scene to picture. All drivers stand on one: the command line renders to the
// last progression, an interactive one goes on from edit to edit.
#pragma once

#include <memory>
#include <string>

#include "base/error.h"
#include "base/paged_memory.h"
#include "base/progress.h"
#include "base/stats.h"
#include "bvh/bvh.h"
#include "film/film.h"
#include "render/made_again.h"
#include "render/part.h"
#include "scene/delayed.h"
#include "scene/schema/options.h"
#include "store/disk_store.h"

namespace kanuka::render {

// What the command line or Python sets over the scene's own options; unset = as the scene says.
struct Overrides {
    scene::OptionEdits options;
    std::optional<int> threads;
    std::optional<float> shading_rate; // multiplies every attribute's
    std::optional<scene::Camera> camera;
    std::vector<scene::Camera>
        shot; // of all frames that are rendered together: what stands still is diced for all
    std::vector<std::string> aovs;     // layers beside those that displays ask for: see Aovs
    int lanes = 0;                     // transport and shading lanes: 1, 8, 16; 0 = widest
    std::string standard_shaders;      // folder
    scene::Delayed* delayed = nullptr; // procedurals to be read when rays meet them
    std::optional<Part> part;          // of the picture: these progressions alone
    std::optional<uint64_t> memory;    // bytes that there are; unset = the machine's
    std::optional<uint64_t>
        page_memory; // bytes of pages that are kept for update(); unset = a quarter of that
    std::optional<store::DiskStore::Settings> store;   // unset = the environment's; no folder = none
    std::optional<MemoryBudget> memory_budget;         // unset = the environment's
    std::string oracle;                                // file of a dicing oracle; empty = none
    bool records_oracle = false;                       // for Session::save_oracle()
    size_t store_window = store::Store::LargestWindow; // words; less, for tests of what lies beyond
    bvh::PagesFrom pages_from;                         // less, for tests of small scenes
};

// A picture of a scene, and what it was made from: prepared once, traced in steps, developed whenever
// somebody looks. Pixels have the same bits for any number of threads, steps, stops and edits on the way.
// Thread safety: one call at a time; Progress::cancelled may be asked from any.
class Session {
  public:
    enum class Keep {
        Nothing, // each making begins at nothing
        Keys,    // what pages are made of is noted: for save() and resume()
        Pages    // and they are kept, as far as there is room, so that update() makes again only what has
                 // changed
    };
    // `scene`, `journal` and `stats` must outlive it; the scene may change between calls, if update()
    // follows.
    Session(const scene::Scene& scene, const Overrides& overrides, Keep keep, Journal& journal, Stats& stats);
    ~Session();
    Session(const Session&) = delete;

    // All until rays can be traced; others call it. False: cancelled. Throws Error where no picture can be
    // made.
    bool prepare(const Progress& progress);
    bool prepared() const;
    // Until every pixel has so many progressions. False: cancelled; what is there stays, and can go on.
    bool advance(int progressions, const Progress& progress);
    int progressions() const; // that every pixel has, of the part
    int wanted() const;       // of the options, or of the part
    // As it is now; empty where nothing is prepared.
    film::Picture picture();
    // The same; the journal is told what was wrong on the way.
    film::Picture finish();

    // The scene, its options or the overrides have changed: the next call makes again what was made of them.
    void update(const Overrides& overrides, Stats& stats);
    // Another scene takes the place of this one, as the next frame of a shot: pages of what is alike in both
    // are kept. `scene` and `journal` must outlive the session; the scene before may go.
    void update(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats);

    // The samples so far, known by all that they depend on: scene, shaders, textures, options, seed, but not
    // how many there are to be. Throw Error; resume() then changed nothing. See merge_checkpoints() too.
    void save(const std::string& path);
    void resume(const std::string& path, const Progress& progress);

    // What rays have looked at so far: a dicing oracle, where Overrides::records_oracle and the integrator is
    // "footprints". Throws Error.
    struct Recorded {
        size_t primitives, seen;
    };
    Recorded save_oracle(const std::string& path) const;

    void close_statistics();
    // Why the last making has diced and shaded primitives, where pages are kept. The first: "first".
    const std::vector<MadeAgain::Reason>& made_again() const;

  private:
    class Impl;
    std::unique_ptr<Impl> m;
};

struct Result {
    film::Picture picture;
    bool cancelled = false;
};

// Renders the scene to the last progression. Fills `stats` and the journal; throws Error only where no
// picture can be made. The scene's large buffers may be released as soon as they are diced. Bit-identical for
// any thread count.
Result render(const scene::Scene& scene, const Overrides& overrides, Journal& journal, Stats& stats,
              const Progress& progress);

} // namespace kanuka::render
