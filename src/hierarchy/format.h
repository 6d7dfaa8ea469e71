// A page of the hierarchy, byte by byte: what is traced is what lies in the file. docs/hierarchy.md draws it.
// Everything is little-endian and found by offsets from the page's first byte, so a page may lie anywhere.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kanuka::hierarchy {

inline constexpr uint32_t Magic = 0x4752484b; // "KHRG"
inline constexpr uint32_t Version = 5;
// References count bytes in units of 16; groups of children begin at multiples of four units.
inline constexpr size_t UnitBytes = 16, GroupUnits = 4;
// Vector loads at the last leaf reach beyond it by less than this.
inline constexpr size_t PaddingBytes = 128;

enum class Kind : uint32_t {
    Nodes,      // Node
    Grid32,     // 4x4 cells, 32 bits a vertex
    Grid48,     // 4x4 cells, 16 bits a coordinate
    GridFloat,  // 4x4 cells, floats: what fits neither, and vertices that are no numbers
    Triangle32, // eight triangles, 32 bits a corner
    TriangleFloat,
    Triangle48, // eight triangles, 16 bits a coordinate
    Fibre32,    // eight segments of fibres, 32 bits an end
    Fibre48,
    FibreFloat,
    Count,            // of kinds that pages of files have
    Instance = Count, // a place of another page (instances.h): levels of them are made in memory
    Moving,           // likewise, where some of a node's eight move
    Changing,         // ChangingNode, of pages of shapes that change
    MovingNodes,      // ChangingNode, of levels: where some of what is below moves
    End               // of stacks alone: nothing is left to look at in the page
};

constexpr bool is_of_triangles(Kind kind) {
    return kind >= Kind::Triangle32 && kind <= Kind::Triangle48;
}
constexpr bool is_of_fibres(Kind kind) {
    return kind >= Kind::Fibre32 && kind <= Kind::FibreFloat;
}
constexpr bool is_of_grids(Kind kind) {
    return kind >= Kind::Grid32 && kind <= Kind::GridFloat;
}

constexpr bool is_of_ends(Kind kind) { // ChangingNode
    return kind == Kind::Changing || kind == Kind::MovingNodes;
}

constexpr bool is_of_nodes(Kind kind) {
    return kind == Kind::Nodes || is_of_ends(kind);
}

// What the stack of a ray holds: a kind in the upper four bits, an offset in units below.
using Ref = uint32_t;
inline constexpr Ref NoRef = ~0u;
inline constexpr int KindShift = 28;
inline constexpr uint32_t OffsetMask = (1u << KindShift) - 1;
constexpr Ref make_ref(Kind kind, size_t byte) {
    return uint32_t(kind) << KindShift | uint32_t(byte / UnitBytes);
}
constexpr Kind kind_of(Ref ref) {
    return Kind(ref >> KindShift);
}
constexpr size_t byte_of(Ref ref) {
    return size_t(ref & OffsetMask) * UnitBytes;
}
constexpr bool is_leaf(Ref ref) {
    return ref >= 1u << KindShift;
}

// Eight children, whose boxes have planes (origin + q) * 2^exponent, axis by axis. Origin and exponent share
// a word: origin << 8 | biased exponent. |origin + q| < 2^23 + 256, so planes are floats without rounding.
struct alignas(64) Node {
    // What is in a box is so many steps or more away from its planes: more than rounding that is relative to
    // the width of the node (docs/hierarchy.md, "Robustness").
    static constexpr double Slack = 0x1p-11;

    uint8_t plane[3][2][8]; // axis, lower or upper, child
    int32_t frame[3];
    uint32_t children; // of one kind, one behind the other: see Children
};
static_assert(sizeof(Node) == 64);

// Boxes that go straight in an interval of time: as they are when it begins, and when it ends. Both have the
// same children. Of shapes that change these are leaves that are two likewise, of one kind.
struct ChangingNode {
    Node begin, end;
};
static_assert(sizeof(ChangingNode) == 128);

struct Children {
    Kind kind;
    int count;       // 1 to 8
    uint32_t offset; // of the first, in units

    static constexpr int CountShift = 25;
    static constexpr uint32_t GroupMask = (1u << CountShift) - 1;
    static constexpr size_t MostBytes = (size_t(GroupMask) + 1) * GroupUnits * UnitBytes; // of a page: 2 GiB

    static Children of(uint32_t word) {
        return {Kind(word >> KindShift), int(word >> CountShift & 7) + 1,
                (word & GroupMask) * uint32_t(GroupUnits)};
    }
    // Of a child. `ends`: 2 where leaves are as an interval begins and as it ends.
    Ref ref(uint32_t place, uint32_t ends = 1) const;
    constexpr uint32_t stride(uint32_t ends = 1) const; // units from a child to the next
    uint32_t word() const {
        return uint32_t(kind) << KindShift | uint32_t(count - 1) << CountShift |
               offset / uint32_t(GroupUnits);
    }
};

// Vertices of 4x4 cells are rows of five. Of a leaf at the border of its grid some cells are missing: their
// vertices repeat the last, and `shape` says how many there are.
inline constexpr int LeafRow = 5, LeafVertices = 25;

// A coordinate is (base + field) * 2^exponent. `frame` holds base << 8 and, axis by axis, the number of the
// field widths (see fields.h), the biased exponent, and the shape.
struct Grid32 {
    uint32_t vertex[LeafVertices];
    int32_t frame[3];
};
static_assert(sizeof(Grid32) == 112);

struct Grid48 {
    int32_t frame[3]; // its first low byte is unused
    uint16_t coordinate[3][LeafVertices];
    uint8_t unused[14];
};
static_assert(sizeof(Grid48) == 176);

struct GridFloat {
    float coordinate[3][LeafVertices];
    uint32_t shape;
    uint8_t unused[16];
};
static_assert(sizeof(GridFloat) == 320);

// Shape of a grid leaf: (columns - 1) | (rows - 1) << 2.
constexpr uint32_t leaf_shape(int columns, int rows) {
    return uint32_t(columns - 1) | uint32_t(rows - 1) << 2;
}

inline constexpr int LeafTriangles = 8;
struct Triangle32 {
    uint32_t corner[3][LeafTriangles];
    int32_t frame[3]; // as of Grid32, with the number of triangles for a shape
    uint32_t unused;
};
static_assert(sizeof(Triangle32) == 112);

struct TriangleFloat {
    float coordinate[3][3][LeafTriangles]; // axis, corner
    uint32_t count;
    uint8_t unused[12];
};
static_assert(sizeof(TriangleFloat) == 304);

struct Triangle48 {
    uint16_t coordinate[3][3][LeafTriangles]; // axis, corner
    int32_t frame[3];                         // as of Grid48, with the number of triangles for a shape
    uint32_t unused;
};
static_assert(sizeof(Triangle48) == 160);

// A segment of a fibre: all balls between two, whose centres and radii change evenly from the one to the
// other. Of radii 12 bits are left; a word counts them from the page's least on, as floats are ordered:
// radius = float of the bits (least_radius + word) << 12.
inline constexpr int LeafSegments = 8;
struct Fibre32 {
    uint32_t end[2][LeafSegments];
    uint16_t radius[2][LeafSegments];
    int32_t frame[3]; // as of Triangle32
    uint32_t least_radius;
};
static_assert(sizeof(Fibre32) == 112);

struct Fibre48 {
    uint16_t coordinate[3][2][LeafSegments]; // axis, end
    uint16_t radius[2][LeafSegments];
    int32_t frame[3]; // as of Triangle48
    uint32_t least_radius;
};
static_assert(sizeof(Fibre48) == 144);

struct FibreFloat {
    float coordinate[3][2][LeafSegments];
    uint16_t radius[2][LeafSegments];
    uint32_t count, least_radius;
    uint8_t unused[8];
};
static_assert(sizeof(FibreFloat) == 240);

// Units from a child to the next, by kind.
inline constexpr uint32_t UnitsOf[16] = {4, 7, 11, 20, 7, 19, 10, 7, 9, 15, 1, 3, 8, 8};
constexpr uint32_t Children::stride(uint32_t ends) const {
    return UnitsOf[uint32_t(kind)] * (is_of_ends(kind) ? 1 : ends);
}
inline Ref Children::ref(uint32_t place, uint32_t ends) const {
    return uint32_t(kind) << KindShift | (offset + place * stride(ends));
}
static_assert(UnitsOf[int(Kind::Nodes)] * UnitBytes == sizeof(Node));
static_assert(UnitsOf[int(Kind::Grid32)] * UnitBytes == sizeof(Grid32));
static_assert(UnitsOf[int(Kind::Grid48)] * UnitBytes == sizeof(Grid48));
static_assert(UnitsOf[int(Kind::GridFloat)] * UnitBytes == sizeof(GridFloat));
static_assert(UnitsOf[int(Kind::Triangle32)] * UnitBytes == sizeof(Triangle32));
static_assert(UnitsOf[int(Kind::TriangleFloat)] * UnitBytes == sizeof(TriangleFloat));
static_assert(UnitsOf[int(Kind::Triangle48)] * UnitBytes == sizeof(Triangle48));
static_assert(UnitsOf[int(Kind::Fibre32)] * UnitBytes == sizeof(Fibre32));
static_assert(UnitsOf[int(Kind::Fibre48)] * UnitBytes == sizeof(Fibre48));
static_assert(UnitsOf[int(Kind::FibreFloat)] * UnitBytes == sizeof(FibreFloat));
static_assert(UnitsOf[int(Kind::Changing)] * UnitBytes == sizeof(ChangingNode));
static_assert(UnitsOf[int(Kind::MovingNodes)] * UnitBytes == sizeof(ChangingNode));
// Names of a leaf: one of grids, one a face or segment of others.
constexpr uint32_t names_of_leaf(Kind kind) {
    return is_of_grids(kind) ? 1 : 8;
}
static_assert(LeafTriangles == 8 && LeafSegments == 8);

// Grids are cut into tiles of at most 2^tile_log blocks of 4x4 cells to a side. A leaf's name, 32 bits, is
// the number of its tile and the place in it: tile << 2 tile_log | v << tile_log | u.
struct Tile {
    uint32_t grid;
    uint16_t u, v; // of its first block, in tiles
};
static_assert(sizeof(Tile) == 8);

// Where the leaves of a kind lie, and their names: that of a leaf at byte b is name (b - leaves) / size of a
// leaf (two, of shapes that change), rounded down. Leaves of triangles and of fibres have eight names each:
// numbers of faces, of segments.
struct Section {
    uint64_t leaves = 0, leaf_bytes = 0, names = 0, name_count = 0;
};

struct Header {
    uint32_t magic, version;
    uint64_t checksum; // XXH3-64 of all bytes behind it
    uint64_t bytes;    // of the page
    float step;        // of its lattice: see lattice.h
    uint32_t root;     // Ref of a node; NoRef = nothing is in the page. Changing: so are all others
    float lower[3], upper[3];
    uint32_t tile_log, tile_count;
    uint64_t nodes, node_bytes;
    uint64_t tiles;
    Section section[10]; // by kind; that of nodes is unused
    uint64_t unused[5];
};
static_assert(sizeof(Header) == 448 && int(Kind::Count) <= 10);
static_assert(offsetof(Header, checksum) == 8);

} // namespace kanuka::hierarchy
