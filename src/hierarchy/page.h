// A page: a block of bytes, in memory that it owns or in a file that is mapped.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/large_pages.h"
#include "base/mapped_file.h"
#include "base/vec.h"
#include "hierarchy/format.h"

namespace kanuka::hierarchy {

// What traversal needs of a page. Whoever made or mapped the bytes keeps them, 64-byte aligned.
class Page {
  public:
    Page() = default;
    explicit Page(const std::byte* bytes, uint32_t number = 0)
        : m_bytes(reinterpret_cast<const uint8_t*>(bytes)), m_number(number) {}
    uint32_t number() const { return m_number; } // in its world

    const Header& header() const { return *reinterpret_cast<const Header*>(m_bytes); }
    const uint8_t* bytes() const { return m_bytes; }
    template <class T>
    const T& at(Ref ref) const {
        return *reinterpret_cast<const T*>(m_bytes + byte_of(ref));
    }
    Bounds3f bounds() const {
        const Header& h = header();
        return {{h.lower[0], h.lower[1], h.lower[2]}, {h.upper[0], h.upper[1], h.upper[2]}};
    }
    // It has shapes that change: each node and leaf is two, as an interval of time begins and as it ends.
    bool changes() const { return kind_of(header().root) == Kind::Changing; }
    const Section& section(Kind kind) const {
        return header().section[std::min(uint32_t(kind), uint32_t(Kind::Count) - 1)];
    }
    // The name of a leaf of a grid, or the number of face or segment `i` of a leaf. What is damaged has the
    // name 0.
    uint32_t name(Ref leaf, int i = 0) const {
        const Kind kind = kind_of(leaf);
        const Section& s = section(kind);
        uint64_t n = (byte_of(leaf) - s.leaves) / (UnitsOf[uint32_t(kind)] * UnitBytes * (changes() ? 2 : 1));
        if (!is_of_grids(kind))
            n = n * names_of_leaf(kind) + unsigned(i);
        return n < s.name_count ? reinterpret_cast<const uint32_t*>(m_bytes + s.names)[n] : 0;
    }

  private:
    const uint8_t* m_bytes = nullptr;
    uint32_t m_number = 0;
};

// body(leaf), whose bytes are of its kind; a place of another page is no such leaf, and has an empty answer.
template <class Body>
[[gnu::always_inline]] inline auto with_leaf(const Page& page, Ref leaf, Body&& body) {
    switch (kind_of(leaf)) {
    case Kind::Grid32:
        return body(page.at<Grid32>(leaf));
    case Kind::Grid48:
        return body(page.at<Grid48>(leaf));
    case Kind::GridFloat:
        return body(page.at<GridFloat>(leaf));
    case Kind::Triangle32:
        return body(page.at<Triangle32>(leaf));
    case Kind::Triangle48:
        return body(page.at<Triangle48>(leaf));
    case Kind::TriangleFloat:
        return body(page.at<TriangleFloat>(leaf));
    case Kind::Fibre32:
        return body(page.at<Fibre32>(leaf));
    case Kind::Fibre48:
        return body(page.at<Fibre48>(leaf));
    case Kind::FibreFloat:
        return body(page.at<FibreFloat>(leaf));
    default:
        return decltype(body(page.at<Grid32>(leaf)))();
    }
}

class PageMemory {
  public:
    PageMemory() = default;
    explicit PageMemory(size_t bytes) : PageMemory(unwritten(bytes)) {
        std::ranges::fill(std::as_writable_bytes(std::span(*m_lines)), std::byte(0));
    }
    // For who writes all of them.
    static PageMemory unwritten(size_t bytes) {
        PageMemory memory;
        memory.m_lines = std::make_shared<Lines>((bytes + sizeof(Line) - 1) / sizeof(Line));
        return memory;
    }
    // What lies in a file from byte `at` on, a multiple of 64.
    PageMemory(MappedFile file, size_t at) : m_file(std::move(file)), m_at(at) {}
    std::byte* data() { return reinterpret_cast<std::byte*>(m_lines->data()); } // of what it owns
    const std::byte* data() const { return bytes().data(); }
    size_t size() const { return bytes().size(); }
    std::span<const std::byte> bytes() const {
        if (!m_file.empty())
            return m_file.bytes().subspan(m_at);
        return m_lines ? std::as_bytes(std::span(*m_lines)) : std::span<const std::byte>();
    }
    // Of what it owns: the bytes stay as long as somebody holds this.
    std::shared_ptr<const void> hold() const { return m_lines; }
    Page page() const { return Page(data()); }

  private:
    struct alignas(64) Line {
        std::byte bytes[64];
        Line() {}
    };
    using Lines = LargeVector<Line>;
    std::shared_ptr<Lines> m_lines;
    MappedFile m_file; // in place of those
    size_t m_at = 0;
};

uint64_t checksum_of(std::span<const std::byte> page);

// Why a page is refused; empty = it may be traced. The checksum is compared, and whatever it says every
// reference is followed once: with a page that passes, however it was made, traversal stays in bounds, and
// comes to an end.
std::string refusal_of(std::span<const std::byte> page);
// The second part alone: for pages whose bytes are known to be whole.
std::string structural_refusal_of(std::span<const std::byte> page);

// The deepest that nodes may lie below the root, which bounds the stack of a ray.
inline constexpr int DeepestNode = 24;
inline constexpr int StackEntries = 7 * (DeepestNode + 1) + 1;

} // namespace kanuka::hierarchy
