// Which faces of a subdivision mesh go which way: the quick ways give what the slow one does, so that nothing
// else tells whether they are taken.
#include <set>

#include "geom/subdivision_kinds.h"
#include "geom/subdivision_regular.h"
#include "geom/test_surfaces.h"

using namespace kanuka;
using namespace kanuka::geom;
using namespace kanuka::geom::testing;

namespace {

constexpr int N = 6, M = 7; // columns and rows of a closed strip of quads
int vertex_at(int i, int j) {
    return (j + M) % M * N + (i + N) % N;
}
scene::SubdivisionMesh strip() {
    std::vector<int32_t> index;
    for (int j = 0; j < M; j++)
        for (int i = 0; i < N; i++)
            for (const int v :
                 {vertex_at(i, j), vertex_at(i + 1, j), vertex_at(i + 1, j + 1), vertex_at(i, j + 1)})
                index.push_back(v);
    scene::SubdivisionMesh m;
    m.vertices_per_face = std::vector<int32_t>(N * M, 4);
    m.vertices = std::move(index);
    return m;
}
std::vector<float> places(int count) {
    std::vector<float> p;
    for (int i = 0; i < 3 * count; i++)
        p.push_back(float(i * 37 % 101) / 50);
    return p;
}
Cage cage_of(const scene::SubdivisionMesh& m, int points) {
    const scene::Primitive p = primitive(m, places(points));
    Journal journal;
    Cage cage;
    EXPECT_TRUE(read_cage(p, m, control_points(p, {}), cage, journal));
    return cage;
}
RegularFaces regular_of(const Cage& cage, int points) {
    RegularFaces regular;
    regular.find(cage, size_t(points), find_edges(cage.first, cage.vertices, points));
    return regular;
}

} // namespace

// On a closed strip all faces are regular, but those that touch what is sharp, and holes; their control
// points are those of the rows and columns around them.
TEST(SubdivisionWays, RegularFacesAreFound) {
    using Tags = std::vector<scene::SubdivisionMesh::Tag>;
    const std::pair<Tags, std::set<int>> cases[] = {
        {{}, {}},
        {{{"corner", {vertex_at(2, 3)}, {2}, {}}},
         {vertex_at(1, 2), vertex_at(2, 2), vertex_at(1, 3), vertex_at(2, 3)}},
        {{{"crease", {vertex_at(2, 3), vertex_at(3, 3)}, {2}, {}}},
         {vertex_at(1, 2), vertex_at(2, 2), vertex_at(3, 2), vertex_at(1, 3), vertex_at(2, 3),
          vertex_at(3, 3)}},
        {{{"hole", {vertex_at(4, 4)}, {}, {}}}, {vertex_at(4, 4)}}};
    for (const auto& [tags, others] : cases) {
        scene::SubdivisionMesh m = strip();
        m.tags = tags;
        const Cage cage = cage_of(m, N * M);
        const RegularFaces regular = regular_of(cage, N * M);
        EXPECT_EQ(regular.count(), size_t(N * M) - others.size());
        for (int j = 0; j < M; j++)
            for (int i = 0; i < N; i++) {
                const int face = vertex_at(i, j);
                ASSERT_EQ(regular.has(face), !others.count(face)) << i << " " << j;
                if (!regular.has(face))
                    continue;
                int points[16], again[16];
                EXPECT_TRUE(regular.points(face, cage.vertices.data(), points));
                regular.points_of_vertices(face, cage.vertices.data(), again);
                for (int k = 0; k < 16; k++) {
                    EXPECT_EQ(points[k], vertex_at(i - 1 + k % 4, j - 1 + k / 4));
                    EXPECT_EQ(again[k], points[k]);
                }
            }
    }
}

// A quad among quads is cut in two by a diagonal: what touches the triangles is not regular. Values that do
// not join at a corner are no control points.
TEST(SubdivisionWays, TrianglesAndSeamsAreNotRegular) {
    scene::SubdivisionMesh m = strip();
    std::vector<int32_t> sizes(N * M - 1, 4), index(m.vertices.begin(), m.vertices.end() - 4);
    const int32_t* q = &m.vertices[size_t(4 * (N * M - 1))];
    sizes.insert(sizes.end(), {3, 3});
    index.insert(index.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
    m.vertices_per_face = sizes, m.vertices = index;
    EXPECT_EQ(regular_of(cage_of(m, N * M), N * M).count(), size_t(N * M - 9));
    const Cage cage = cage_of(strip(), N * M);
    const RegularFaces regular = regular_of(cage, N * M);
    for (size_t corner = 0; corner < 4 * N * M; corner += 5) { // of one face alone, its value is another
        std::vector<int> seam = cage.vertices;
        seam[corner] = N * M;
        int points[16], apart = 0;
        for (int f = 0; f < N * M; f++)
            apart += !regular.points(f, seam.data(), points);
        // The faces around the vertex whose value is torn all have it among their sixteen; of others some.
        EXPECT_GE(apart, 4) << corner;
        EXPECT_LE(apart, 16) << corner;
    }
}

// Faces around a vertex of three, five, six or nine have a matrix each, which gives what OpenSubdiv
// evaluates.
TEST(SubdivisionWays, IrregularFacesHaveKinds) {
    for (const int valence : {3, 5, 6, 9}) {
        // Two rings of quads around the vertex 0.
        scene::SubdivisionMesh m;
        std::vector<int32_t> index;
        const auto ring = [&](int r, int k) { // 2 r a sector; 0: the middle
            const int around = 2 * r * valence;
            return r == 0 ? 0 : 1 + r * (r - 1) * valence + (k + around) % around;
        };
        for (int s = 0; s < valence; s++)
            for (int r = 0; r < 3; r++)
                for (int k = 0; k <= r; k++) {          // both sides of the sector's diagonal
                    const auto at = [&](int a, int b) { // a along one arm, b along the next
                        const int out = std::max(a, b);
                        return out == 0 ? 0 : ring(out, 2 * out * s + (a >= b ? b : 2 * out - a));
                    };
                    for (const auto& [a, b] : {std::pair{r, k}, {k, r}}) {
                        if (a == b && a != r)
                            continue;
                        for (const int v : {at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)})
                            index.push_back(v);
                        if (k == r)
                            break;
                    }
                }
        const int points = 1 + 12 * valence;
        m.vertices_per_face = std::vector<int32_t>(index.size() / 4, 4);
        m.vertices = index;
        const Cage cage = cage_of(m, points);
        const auto refiner = make_refiner(cage, size_t(points), {});
        ASSERT_TRUE(refiner);
        SurfaceFactory::Options options;
        SurfaceFactory factory(*refiner, options);
        const std::vector<float> p = places(points);
        std::vector<double> exact(p.begin(), p.end());
        int kinds = 0;
        for (int f = 0; f < int(cage.sizes.size()); f++) {
            osd::Bfr::Surface<double> surface;
            if (!factory.InitVertexSurface(f, &surface) || surface.IsRegular())
                continue;
            const auto kind = PatchKind::make(surface, -1);
            ASSERT_TRUE(kind) << valence << " face " << f;
            kinds++;
            std::vector<int> control(size_t(surface.GetNumControlPoints()));
            surface.GetControlPointIndices(control.data());
            const ControlValues values(p.data(), 3, control.data(), int(control.size()));
            const std::vector<float> t{0, 0.1f, 0.3f, 0.55f, 0.8f, 1};
            constexpr int T = 6;
            std::vector<float> out(9 * T * T);
            PatchTarget targets[3];
            for (int c = 0; c < 3; c++)
                targets[c] = {&out[size_t(c * T * T)], &out[size_t((3 + c) * T * T)],
                              &out[size_t((6 + c) * T * T)]};
            kind->fill(values, {t.data(), T}, {t.data(), T}, targets, 3, T);
            std::vector<double> patch(size_t(surface.GetNumPatchPoints()) * 3);
            surface.PreparePatchPoints(exact.data(), 3, patch.data(), 3);
            for (int j = 0; j < T; j++)
                for (int i = 0; i < T; i++) {
                    const double uv[2] = {double(t[size_t(i)]), double(t[size_t(j)])};
                    double at[3], du[3], dv[3];
                    surface.Evaluate(uv, patch.data(), 3, at, du, dv);
                    for (int c = 0; c < 3; c++) {
                        const size_t k = size_t(j * T + i);
                        EXPECT_NEAR(targets[c].value[k], at[c], 4e-6);
                        EXPECT_NEAR(targets[c].du[k], du[c], 1e-4);
                        EXPECT_NEAR(targets[c].dv[k], dv[c], 1e-4);
                    }
                }
        }
        EXPECT_EQ(kinds, valence);
    }
}
