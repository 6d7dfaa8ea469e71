#define XXH_INLINE_ALL
#include "hierarchy/page.h"

#include <cmath>
#include <xxhash.h>

namespace kanuka::hierarchy {

namespace {

// Follows the references of a page, each of which may be met once: so a walk through the page ends.
class Walk {
  public:
    explicit Walk(std::span<const std::byte> bytes)
        : m_page(bytes.data()), m_header(m_page.header()), m_met(bytes.size() / UnitBytes) {}

    std::string run() {
        if (m_header.root == NoRef)
            return {};
        const Kind inner = kind_of(m_header.root); // what all nodes are
        if ((inner != Kind::Nodes && inner != Kind::Changing) || !is_within(m_header.root))
            return "its root lies outside";
        std::vector<Entry> todo{{m_header.root, 0}};
        while (!todo.empty()) {
            const auto [ref, depth] = todo.back();
            todo.pop_back();
            if (depth > DeepestNode)
                return "its nodes lie too deep";
            const Children c = Children::of(m_page.at<Node>(ref).children);
            const bool is_inner = c.kind == inner;
            if (!is_inner && (c.kind == Kind::Nodes || uint32_t(c.kind) >= uint32_t(Kind::Count)))
                return "it has leaves of an unknown kind";
            for (uint32_t i = 0; i < uint32_t(c.count); i++) {
                const Ref child = c.ref(i, m_page.changes() ? 2 : 1);
                if (!is_within(child))
                    return "its nodes refer to places outside";
                if (m_met[child & OffsetMask])
                    return "its nodes refer to a place twice";
                m_met[child & OffsetMask] = true;
                if (is_inner)
                    todo.push_back({child, depth + 1});
            }
        }
        return {};
    }

  private:
    struct Entry {
        Ref ref;
        int depth;
    };
    bool is_within(Ref ref) const {
        const Kind kind = kind_of(ref);
        const bool is_node = kind == kind_of(m_header.root);
        const Section& s = m_page.section(kind);
        const uint64_t begin = is_node ? m_header.nodes : s.leaves;
        const uint64_t bytes = is_node ? m_header.node_bytes : s.leaf_bytes;
        const uint64_t at = byte_of(ref),
                       size = UnitsOf[uint32_t(kind)] * UnitBytes * (m_page.changes() && !is_node ? 2 : 1);
        return at >= begin && at - begin + size <= bytes && at % (is_node ? sizeof(Node) : 1) == 0;
    }

    Page m_page;
    const Header& m_header;
    std::vector<bool> m_met; // by the unit at which something begins
};

bool lies_within(const Header& h, uint64_t at, uint64_t bytes, uint64_t after) {
    return at >= sizeof(Header) && at % UnitBytes == 0 && at <= h.bytes && bytes <= h.bytes - at &&
           h.bytes - at - bytes >= after;
}

std::string refused_header(std::span<const std::byte> page) {
    if (page.size() < sizeof(Header) || reinterpret_cast<uintptr_t>(page.data()) % alignof(Node) != 0)
        return "it is too short, or not aligned to 64 bytes";
    const Header& h = Page(page.data()).header();
    if (h.magic != Magic)
        return "it is no page of a hierarchy";
    if (h.version != Version)
        return "it is of version " + std::to_string(h.version) + "; expected " + std::to_string(Version);
    if (h.bytes > page.size() || h.bytes < sizeof(Header) || h.bytes > Children::MostBytes)
        return "it is cut short";
    bool within = lies_within(h, h.nodes, h.node_bytes, 0) && h.nodes % sizeof(Node) == 0 &&
                  h.tile_log <= 6 && lies_within(h, h.tiles, uint64_t(h.tile_count) * sizeof(Tile), 0);
    for (int k = 1; k < int(Kind::Count); k++) {
        const Section& s = h.section[k];
        within = within && s.name_count < h.bytes && lies_within(h, s.leaves, s.leaf_bytes, PaddingBytes) &&
                 lies_within(h, s.names, s.name_count * sizeof(uint32_t), 0);
    }
    return within ? "" : "its parts lie outside";
}

} // namespace

uint64_t checksum_of(std::span<const std::byte> page) {
    const Header& h = Page(page.data()).header();
    constexpr size_t Behind = offsetof(Header, bytes);
    return XXH3_64bits(page.data() + Behind, size_t(h.bytes) - Behind);
}

std::string structural_refusal_of(std::span<const std::byte> page) {
    const std::string refused = refused_header(page);
    return refused.empty() ? Walk(page).run() : refused;
}

std::string refusal_of(std::span<const std::byte> page) {
    std::string refused = refused_header(page);
    if (!refused.empty())
        return refused;
    if (checksum_of(page) != Page(page.data()).header().checksum)
        return "its checksum does not match";
    return Walk(page).run();
}

} // namespace kanuka::hierarchy
