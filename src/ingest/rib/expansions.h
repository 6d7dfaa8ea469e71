// What programs and plug-ins have made of procedurals, kept from frame to frame of a shot: what is asked
// alike is made once. Archives are files, which every frame reads.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/digest.h"
#include "scene/scene.h"

namespace kanuka::ingest {

struct ProceduralRequest;

// Of all frames. Thread safety: all calls.
class Expansions {
  public:
    // `bytes`: of RIB that is kept at most. `shot`: cameras of all frames; a procedural is as detailed as the
    // nearest of them asks for.
    Expansions(std::vector<scene::Camera> shot, uint64_t bytes) : m_shot(std::move(shot)), m_budget(bytes) {}
    const std::vector<scene::Camera>& shot() const { return m_shot; }

    // One frame's requests, in the order in which it makes them.
    class Frame;

  private:
    using Text = std::shared_ptr<const std::string>;
    // Which request, of those that are alike in a frame: a program may answer each in another way.
    using Key = std::pair<Digest, uint32_t>;
    struct Kept {
        Text text;
        std::optional<double> detail; // none = it made no use of that
        uint64_t used;                // number of the last frame that had it
    };
    // What is asked, but for how detailed.
    static constexpr std::array<const char*, 5> Parts = {"arguments", "parameters", "bound", "search path",
                                                         "declarations"};
    using Asked = std::array<Digest, Parts.size()>;

    void keep(const Key& key, Kept kept);

    const std::vector<scene::Camera> m_shot;
    const uint64_t m_budget;
    std::mutex m_mutex;
    uint64_t m_bytes = 0, m_frames = 0;
    std::map<Key, Kept> m_kept;
    std::map<std::pair<std::string, uint32_t>, Asked> m_asked; // the name, and which request for it
};

class Expansions::Frame {
  public:
    struct Counts {
        uint64_t asked = 0, kept = 0;
    };
    struct Reason {
        std::string why; // "new", "detail", a part that is not as it was, "no room"
        uint64_t procedurals = 0;
        std::string name; // of the first of them
    };
    explicit Frame(std::shared_ptr<Expansions> all);

    using Answer = std::optional<std::string>;
    // What the frames before were answered, or else what `ask` gives; none = nobody knows such a procedural.
    // What it throws passes through, and is asked again by the next frame.
    Answer answer(const ProceduralRequest& request, const std::function<Answer()>& ask);
    const std::vector<scene::Camera>& shot() const { return m_all->shot(); }
    Counts counts() const;
    // Why they were asked that frames before had asked for too; of the first frame: nothing.
    std::vector<Reason> reasons() const;

  private:
    void note(const std::string& why, const std::string& name);
    void explain(const ProceduralRequest& request, const std::string& name, const Asked& asked,
                 const Asked* before, const Kept* kept);

    std::shared_ptr<Expansions> m_all;
    uint64_t m_number;
    std::map<Digest, uint32_t> m_alike;        // requests so far
    std::map<std::string, uint32_t> m_by_name; // likewise
    Counts m_counts;
    std::vector<Reason> m_reasons;
};

} // namespace kanuka::ingest
