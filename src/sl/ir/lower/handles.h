// Which co-shader a handle stands for, followed through the stage: the stores so far.
#pragma once

#include <functional>

#include "sl/ir/lower/lowerer.h"

namespace kanuka::sl::ir {

class HandleTracker : public Lowerer {
  public:
    explicit HandleTracker(LowerContext& context);
    void begin_stage();
    // A store that comes later in a loop may bring a co-shader that a call before it has not reckoned with.
    void end_stage();
    bool missed() const { return m_missed; }

    // The handles of a parameter that is connected; null where it is not, or not of a kind that may be.
    const std::vector<std::string>* connected(const std::string& parameter) const;
    // The layer's output that gives a parameter its value, or null.
    const Connection* layered(const std::string& parameter) const;
    std::string known(const std::string& handle) const; // handles of what is not there are null
    std::vector<int> targets(Ref handle);               // the co-shaders that it may stand for
    // `what` runs for each co-shader that the handle may be; where it is that one.
    void for_targets(Ref handle, const std::vector<int>& found, Loc at, const std::function<void(int)>& what);

  private:
    std::vector<int> find(Ref handle);
    void note_stores();

    std::map<std::string, const std::vector<std::string>*> m_connections; // by parameter
    std::map<std::string, const Connection*> m_layered;                   // those of layers' outputs
    bool m_missed = false;
    // Of the stage
    size_t m_stores_seen = 0;
    std::map<int, std::vector<Ref>> m_stored; // by variable
    std::vector<std::pair<Ref, std::vector<int>>> m_asked;
};

} // namespace kanuka::sl::ir
