#include "dice/gridder.h"

namespace kanuka::dice {

static int side_cells(const Piece& p, int side) {
    return side == grid::VMin || side == grid::VMax ? p.nu : p.nv;
}

static float natural(const Piece& p, int side, int i) {
    const bool along_u = side == grid::VMin || side == grid::VMax;
    const float a = along_u ? p.u0 : p.v0, b = along_u ? p.u1 : p.v1;
    return a + (b - a) * (float(i) / float(side_cells(p, side)));
}

void side_parameters(const Splitter& splitter, const Piece& piece, int side, std::vector<float>& out) {
    const int n = side_cells(piece, side);
    const Segment& s = piece.sides[side];
    out.resize(n + 1);
    const bool keep = s.cells == n || splitter.edges[s.edge].point;
    for (int i = 0; i <= n; i++)
        out[i] = keep ? natural(piece, side, i)
                      : splitter.parameter(piece, side, splitter.polyline_index(s, side, i, n));
}

grid::Grid make_grid(const Splitter& splitter, const Piece& piece) {
    return make_grid(splitter, splitter.surface(), piece);
}

grid::Grid make_grid(const Splitter& splitter, const geom::Surface& surface, const Piece& piece) {
    grid::Grid g;
    g.allocate(piece.nu, piece.nv);
    surface.allocate_channels(g);
    g.face = surface.uniform_index(piece.face);
    g.flips = surface.flips();
    fill_grid(splitter, surface, piece, g);
    return g;
}

void fill_grid(const Splitter& splitter, const geom::Surface& surface, const Piece& piece, grid::Grid& g) {
    constexpr int Few = 40;
    const int nu = piece.nu, nv = piece.nv;
    std::array<float, 2 * Few> few;
    std::vector<float> many(std::max(nu, nv) < Few ? 0 : size_t(nu + nv + 2)), moved;
    float* const us = many.empty() ? few.data() : many.data();
    float* const vs = us + (many.empty() ? Few : nu + 1);
    for (int i = 0; i <= nu; i++)
        us[i] = natural(piece, grid::VMin, i);
    for (int j = 0; j <= nv; j++)
        vs[j] = natural(piece, grid::UMin, j);
    surface.evaluate(piece.face, {us, nu + 1}, {vs, nv + 1}, {g, 0, nu + 1});
    for (int side = 0; side < 4; side++) {
        const Segment& s = piece.sides[side];
        const int n = side_cells(piece, side);
        const bool point = splitter.edges[s.edge].point;
        g.edge_cells[side] = point ? n : s.cells;
        if (point || s.cells == n)
            continue;
        side_parameters(splitter, piece, side, moved);
        // A corner belongs to two sides; the one that moves it says where to.
        const int from = moved[0] != natural(piece, side, 0) ? 0 : 1;
        const int to = moved[n] != natural(piece, side, n) ? n : n - 1;
        if (to < from)
            continue;
        const geom::Line line{moved.data() + from, to - from + 1};
        if (side == grid::VMin)
            surface.evaluate(piece.face, line, {vs, 1}, {g, from, nu + 1});
        else if (side == grid::VMax)
            surface.evaluate(piece.face, line, {vs + nv, 1}, {g, nv * (nu + 1) + from, nu + 1});
        else if (side == grid::UMin)
            surface.evaluate(piece.face, {us, 1}, line, {g, from * (nu + 1), nu + 1});
        else
            surface.evaluate(piece.face, {us + nu, 1}, line, {g, from * (nu + 1) + nu, nu + 1});
    }
}

void fill_part(const geom::Surface& surface, const Piece& piece, const LatticePart& part, grid::Grid& g) {
    float us[MostFew + 1], vs[MostFew + 1];
    for (int i = part.i0; i <= part.i1; i++)
        us[i - part.i0] = natural(piece, grid::VMin, i);
    for (int j = part.j0; j <= part.j1; j++)
        vs[j - part.j0] = natural(piece, grid::UMin, j);
    surface.evaluate(piece.face, {us, part.columns()}, {vs, part.rows()}, {g, 0, part.columns()});
}

void list_boundary(const Splitter& splitter, const Piece& piece, std::vector<BoundaryVertex>& out) {
    out.clear();
    const int nu = piece.nu, nv = piece.nv, row = nu + 1;
    // Most often nothing moves.
    bool plain = true;
    for (int side = 0; side < 4; side++)
        plain &= piece.sides[side].cells == side_cells(piece, side);
    if (plain) {
        const auto add = [&](int side, int index, int i) {
            const Segment& s = piece.sides[side];
            const Edge& e = splitter.edges[s.edge];
            out.push_back({index, splitter.point(e, s.begin + (s.reversed ? s.cells - i : i)), false});
        };
        for (int i = 1; i < nu; i++)
            add(grid::VMin, i, i);
        for (int i = 1; i < nv; i++)
            add(grid::UMax, i * row + nu, i);
        for (int i = 1; i < nu; i++)
            add(grid::VMax, nv * row + i, i);
        for (int i = 1; i < nv; i++)
            add(grid::UMin, i * row, i);
        add(grid::VMin, 0, 0);
        add(grid::VMin, nu, nu);
        add(grid::UMax, nv * row + nu, nv);
        add(grid::VMax, nv * row, 0);
        return;
    }
    const auto lattice = [&](int side, int i) {
        switch (side) {
        case grid::VMin:
            return i;
        case grid::VMax:
            return nv * row + i;
        case grid::UMin:
            return i * row;
        default:
            return i * row + nu;
        }
    };
    std::array<bool, 4> corner_moved{}; // (0,0), (nu,0), (nu,nv), (0,nv)
    std::array<int, 4> corner_point{-1, -1, -1, -1};
    for (int side = 0; side < 4; side++) {
        const Segment& s = piece.sides[side];
        const Edge& e = splitter.edges[s.edge];
        const int n = side_cells(piece, side);
        const bool whole = s.cells == n; // every vertex has its own
        for (int i = 0; i <= n; i++) {
            const int k = whole ? s.begin + (s.reversed ? n - i : i) : splitter.polyline_index(s, side, i, n);
            const bool moved =
                !e.point && !whole && splitter.parameter(piece, side, k) != natural(piece, side, i);
            const int point = splitter.point(e, k);
            if (i > 0 && i < n) {
                out.push_back({lattice(side, i), point, moved});
                continue;
            }
            constexpr int Corner[4][2] = {{0, 1}, {1, 2}, {3, 2}, {0, 3}};
            const int c = Corner[side][i > 0];
            if (moved || corner_point[c] < 0)
                corner_point[c] = point;
            corner_moved[c] |= moved;
        }
    }
    const int corner_index[4] = {0, nu, nv * row + nu, nv * row};
    for (int c = 0; c < 4; c++)
        out.push_back({corner_index[c], corner_point[c], corner_moved[c]});
}

} // namespace kanuka::dice
