// Where in a scene the node of an id stands: an open-addressing table, 8 bytes a slot. The ids themselves
// stay in the nodes, and are looked up there.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "scene/node.h"

namespace kanuka::scene {

// A list of nodes, as the editor numbers them, and an index into it.
struct NodePlace {
    uint32_t list, index;
};

class NodeIndex {
  public:
    static constexpr uint32_t MostLists = 1 << 24;

    void clear() {
        m_slots.clear();
        m_used = 0;
    }
    // `id_at` tells the id of a NodePlace.
    template <class IdAt>
    std::optional<NodePlace> find(NodeId id, const IdAt& id_at) const {
        if (m_slots.empty())
            return std::nullopt;
        for (size_t i = home(id);; i = (i + 1) & (m_slots.size() - 1)) {
            if (m_slots[i] == Empty)
                return std::nullopt;
            if (m_slots[i] >> 56 == uint64_t(id) >> 56 && id_at(place(m_slots[i])) == id)
                return place(m_slots[i]);
        }
    }
    // The node stands there already. In lists beyond the most it is not found.
    template <class IdAt>
    void insert(NodeId id, NodePlace at, const IdAt& id_at) {
        if (at.list >= MostLists - 1)
            return;
        if (5 * (m_used + 1) > 4 * m_slots.size()) {
            std::vector<uint64_t> before(std::max<size_t>(16, 2 * m_slots.size()), Empty);
            before.swap(m_slots);
            for (const uint64_t slot : before)
                if (slot != Empty)
                    put(id_at(place(slot)), slot);
        }
        put(id, uint64_t(id) >> 56 << 56 | uint64_t(at.list) << 32 | at.index);
        m_used++;
    }
    size_t bytes() const { return m_slots.capacity() * sizeof(uint64_t); }

  private:
    static constexpr uint64_t Empty = ~uint64_t(0); // no list has that number
    static NodePlace place(uint64_t slot) { return {uint32_t(slot >> 32) & (MostLists - 1), uint32_t(slot)}; }
    size_t home(NodeId id) const { return size_t(id) & (m_slots.size() - 1); }
    void put(NodeId id, uint64_t slot) {
        size_t i = home(id);
        while (m_slots[i] != Empty)
            i = (i + 1) & (m_slots.size() - 1);
        m_slots[i] = slot;
    }
    std::vector<uint64_t> m_slots; // the id's top 8 bits, list, index; as many as a power of two
    size_t m_used = 0;
};

} // namespace kanuka::scene
