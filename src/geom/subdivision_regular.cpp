#include "geom/subdivision_regular.h"

namespace kanuka::geom {

void RegularFaces::find(const Cage& cage, size_t points, const PolygonEdges& edges) {
    constexpr size_t MostCorners = size_t(1) << 30; // that fit a twin
    const size_t corners = cage.vertices.size(), faces = cage.sizes.size();
    if (cage.scheme != osd::Sdc::SCHEME_CATMARK || corners >= MostCorners)
        return;
    // Step 1: the two sides of every edge. Corners count at their vertices; what is no interior edge between
    // two faces that turn alike, what is tagged and what touches other faces than quads counts beyond four.
    constexpr uint8_t Odd = 100;
    std::vector<uint8_t> valence(points, 0);
    const auto odd = [&](int v) { valence[v] = Odd; };
    std::vector<uint32_t> side(edges.edges.size(), None);
    m_twin.assign(corners, None);
    for (size_t f = 0; f < faces; f++) {
        const int begin = cage.first[f], n = cage.sizes[f];
        for (int k = 0; k < n; k++) {
            uint8_t& at = valence[cage.vertices[begin + k]];
            at = n == 4 ? uint8_t(std::min<int>(at + 1, Odd)) : Odd;
            const PolygonEdges::Half half = edges.halves[begin + k];
            const uint32_t own = uint32_t(begin) * 4 + uint32_t(k & 3);
            uint32_t& other = side[half.edge];
            if (n != 4) {
                other = None - 1; // whoever meets it finds no quad
            } else if (other == None) {
                other = own;
            } else if (other != None - 1) {
                const size_t corner = other / 4 + other % 4;
                const bool meets = m_twin[corner] == None && edges.halves[corner].reversed != half.reversed;
                if (meets) {
                    m_twin[corner] = own;
                    m_twin[begin + k] = other;
                } else { // a third face, or one that turns the other way
                    odd(edges.edges[half.edge][0]);
                    odd(edges.edges[half.edge][1]);
                }
            }
        }
    }
    for (size_t c = 0; c < corners; c++)
        if (m_twin[c] == None)
            for (const int v : edges.edges[edges.halves[c].edge])
                odd(v);
    for (const int v : cage.crease_pairs)
        odd(v);
    for (const int v : cage.corner_vertices)
        odd(v);
    // Step 2: faces. Two neighbours that are one face would close around a corner two by two.
    m_regular.assign(faces, 0);
    m_first.assign(cage.first.begin(), cage.first.end());
    for (size_t f = 0; f < faces; f++) {
        const int begin = cage.first[f];
        bool good = cage.sizes[f] == 4;
        for (int k = 0; k < 4 && good; k++)
            good = valence[cage.vertices[begin + k]] == 4 && m_twin[begin + k] != None &&
                   m_twin[begin + k] / 4 != m_twin[begin + (k + 1) % 4] / 4;
        m_regular[f] = good;
    }
    for (const int f : cage.holes)
        m_regular[f] = 0;
    for (const char r : m_regular)
        m_count += size_t(r);
}

template <bool Check>
bool RegularFaces::find_points(int face, const int* of_corner, int* out) const {
    const uint32_t begin = uint32_t(m_first[face]);
    // Where corner k, and beyond side k what is next to its first and second corner, and what is diagonally
    // beyond corner k, lie among the 16.
    constexpr int At[4] = {5, 6, 10, 9}, First[4] = {1, 7, 14, 8}, Second[4] = {2, 11, 13, 4},
                  Beyond[4] = {0, 3, 15, 12};
    uint32_t twin[4];
    for (int k = 0; k < 4; k++) {
        twin[k] = m_twin[begin + k];
        out[At[k]] = of_corner[begin + k];
    }
    const auto corner = [](uint32_t side, uint32_t ahead) { return side / 4 + (side % 4 + ahead) % 4; };
    bool joined = true;
    for (int k = 0; k < 4; k++) {
        const uint32_t t = twin[k], before = twin[(k + 3) % 4];
        // The twin runs from corner k + 1 to corner k; the side after it leads outwards, to the diagonal
        // face.
        const uint32_t d = m_twin[corner(t, 1)];
        const int own = out[At[k]];
        const int first = of_corner[corner(t, 2)], second = of_corner[corner(t, 3)];
        out[First[k]] = first;
        out[Second[k]] = second;
        out[Beyond[k]] = of_corner[corner(d, 3)];
        if (Check)
            joined &= of_corner[corner(t, 1)] == own && of_corner[corner(before, 0)] == own &&
                      of_corner[corner(d, 1)] == own && of_corner[corner(d, 0)] == first &&
                      of_corner[corner(d, 2)] == of_corner[corner(before, 3)];
    }
    return joined;
}

bool RegularFaces::points(int face, const int* of_corner, int* out) const {
    return find_points<true>(face, of_corner, out);
}

void RegularFaces::points_of_vertices(int face, const int* of_corner, int* out) const {
    find_points<false>(face, of_corner, out);
}

} // namespace kanuka::geom
