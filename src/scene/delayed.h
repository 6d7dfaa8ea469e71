// Procedurals that nobody has read yet: boxes that hold what they would make, and a way to have it made.
// Whoever traces rays says which boxes they meet (render/on_demand.h).
#pragma once

#include <deque>
#include <span>
#include <vector>

#include "scene/links.h"

namespace kanuka::scene {

// What was read stays: a second render begins with it. Thread safety: none; one render at a time.
class Delayed {
  public:
    virtual ~Delayed() = default;

    // In world space. Grows where procedurals bring others.
    const std::vector<Bounds3f>& bounds() const { return m_bounds; }
    bool is_read(size_t i) const { return m_read[i]; }
    // By where its request stands among those of the scene: the same in all frames of a shot.
    NodeId node(size_t i) const { return m_nodes[i]; }
    size_t read_count() const { return m_read_count; }
    // What was read, in order. Their groups are numbered on from those of the scene and of earlier parts;
    // their solids are their own.
    const std::deque<Scene>& parts() const { return m_parts; }

    // Reads these, in the order given, into one part more. Bounds may move in memory.
    void read(std::span<const uint32_t> which) {
        for (const uint32_t i : which)
            m_read[i] = true;
        m_read_count += which.size();
        m_parts.push_back(expand(which));
        if (!m_lights.empty())
            LightSwitch(m_lights).turn_on(m_parts.back());
    }
    // Of those that are read, how many were before any ray met them: frames before had met them.
    size_t ahead_count() const { return m_ahead_count; }
    void read_ahead(std::span<const uint32_t> which) {
        m_ahead_count += which.size();
        read(which);
    }
    // The scene got a light of that name since: it shines on what was read, and on what will be.
    void shine(const std::string& light) {
        m_lights.push_back(light);
        LightSwitch on({light});
        for (Scene& part : m_parts)
            on.turn_on(part);
    }

  protected:
    virtual Scene expand(std::span<const uint32_t> which) = 0;
    void add(const Bounds3f& bound, NodeId node) {
        m_bounds.push_back(bound);
        m_nodes.push_back(node);
        m_read.push_back(false);
    }

  private:
    std::vector<Bounds3f> m_bounds;
    std::vector<bool> m_read;
    std::vector<NodeId> m_nodes;
    size_t m_read_count = 0, m_ahead_count = 0;
    std::deque<Scene> m_parts;
    std::vector<std::string> m_lights; // that came later
};

} // namespace kanuka::scene
