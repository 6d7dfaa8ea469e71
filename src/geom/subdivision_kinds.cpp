// Which kind of patch the irregular faces are.
#include "geom/subdivision_kinds.h"

#include <bit>
#include <unordered_map>

#include "base/tasks.h"

namespace kanuka::geom {
namespace {

constexpr int LeastFaces = 32; // of a kind: making it costs as much as evaluating so many faces
constexpr size_t Grain = 64;   // faces of a task

using Signature = std::pair<uint64_t, uint64_t>;
struct SignatureHash {
    size_t operator()(const Signature& s) const { return s.first; }
};

// Two maps that agree bit for bit at a point without symmetries are the same.
Signature signature(const osd::Bfr::Surface<double>& surface, int corner, std::vector<double>& stencil) {
    double uv[2] = {0.371283, 0.617349};
    if (corner >= 0) {
        const double local[2] = {uv[0], uv[1]};
        surface.GetParameterization().ConvertNormalizedSubFaceToCoord(corner, local, uv);
    }
    stencil.resize(surface.GetNumControlPoints());
    surface.EvaluateStencil(uv, stencil.data());
    uint64_t a = stencil.size(), b = ~a;
    for (const double w : stencil) {
        a = (a ^ std::bit_cast<uint64_t>(w)) * 0x9e3779b97f4a7c15ull;
        a ^= a >> 29;
        b = (b + std::bit_cast<uint64_t>(w)) * 0xd6e8feb86659fd93ull;
        b ^= b >> 32;
    }
    return {a, b};
}

// By irregular face: its kind, -1 = too few are like it. `examples`: the first face of each kind.
std::vector<int> group(const std::vector<Signature>& signatures, const std::vector<int>& counts,
                       std::vector<size_t>& examples) {
    struct Group {
        int faces = 0, kind = -1;
        size_t first = 0;
    };
    std::unordered_map<Signature, Group, SignatureHash> groups;
    for (size_t i = 0; i < signatures.size(); i++)
        if (counts[i] > 0) {
            Group& g = groups[signatures[i]];
            if (g.faces++ == 0)
                g.first = i;
        }
    std::vector<int> kinds(signatures.size(), -1);
    for (size_t i = 0; i < signatures.size(); i++)
        if (counts[i] > 0) {
            Group& g = groups[signatures[i]];
            if (g.first == i && g.faces >= LeastFaces) {
                g.kind = int(examples.size());
                examples.push_back(i);
            }
            kinds[i] = g.kind;
        }
    return kinds;
}

} // namespace

void PatchKinds::find(const std::vector<Face>& faces, const Init& init,
                      const std::function<bool(int)>& skip) {
    std::vector<int> irregular;
    for (size_t f = 0; f < faces.size(); f++)
        if (!skip(int(f)))
            irregular.push_back(int(f));
    std::vector<Signature> signatures(irregular.size());
    std::vector<int> counts(irregular.size(), 0);
    tasks::parallel_chunks(irregular.size(), Grain, [&](size_t begin, size_t end) {
        std::vector<double> stencil;
        DoubleSurface surface;
        for (size_t i = begin; i < end; i++) {
            const Face& face = faces[irregular[i]];
            if (!init(face.base, surface) || surface.IsRegular() ||
                surface.GetParameterization().GetType() == osd::Bfr::Parameterization::TRI)
                continue;
            signatures[i] = signature(surface, face.corner, stencil);
            counts[i] = surface.GetNumControlPoints();
        }
    });
    std::vector<size_t> examples;
    const std::vector<int> kinds = group(signatures, counts, examples);
    if (examples.empty())
        return;
    m_kinds.resize(examples.size());
    m_count.resize(examples.size());
    tasks::parallel_chunks(examples.size(), 1, [&](size_t begin, size_t end) {
        DoubleSurface surface;
        for (size_t k = begin; k < end; k++) {
            const Face& face = faces[irregular[examples[k]]];
            init(face.base, surface);
            m_kinds[k] = PatchKind::make(surface, face.corner);
            m_count[k] = counts[examples[k]];
        }
    });
    find_points(faces, irregular, kinds, counts, init);
}

// The control points of faces that have a kind.
void PatchKinds::find_points(const std::vector<Face>& faces, const std::vector<int>& irregular,
                             const std::vector<int>& kinds, const std::vector<int>& counts,
                             const Init& init) {
    m_of.assign(faces.size(), -1);
    m_first.assign(faces.size(), 0);
    size_t total = 0;
    for (size_t i = 0; i < irregular.size(); i++) {
        if (kinds[i] < 0 || !m_kinds[kinds[i]])
            continue;
        const int f = irregular[i];
        m_of[f] = kinds[i];
        // The quads of an n-gon lie side by side and have the same control points.
        const bool same = i > 0 && irregular[i - 1] == f - 1 && m_of[f - 1] >= 0 &&
                          faces[f - 1].base == faces[f].base && counts[i - 1] == counts[i];
        m_first[f] = same ? m_first[f - 1] : total;
        total += same ? 0 : size_t(counts[i]);
    }
    m_points.resize(total);
    tasks::parallel_chunks(irregular.size(), Grain, [&](size_t begin, size_t end) {
        DoubleSurface surface;
        for (size_t i = begin; i < end; i++) {
            const int f = irregular[i];
            const bool shared = f > 0 && m_of[f] >= 0 && m_of[f - 1] >= 0 && m_first[f] == m_first[f - 1] &&
                                faces[f - 1].base == faces[f].base;
            if (m_of[f] >= 0 && !shared && init(faces[f].base, surface))
                surface.GetControlPointIndices(m_points.data() + m_first[f]);
        }
    });
}

} // namespace kanuka::geom
