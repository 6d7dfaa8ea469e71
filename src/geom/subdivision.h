// The cage of a subdivision mesh, checked, with its tags, as OpenSubdiv wants it. Only subdivision*.cpp
// include this.
#pragma once

#include <map>
#include <mutex>
#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#include <shared_mutex>

#include "geom/surface.h"

namespace kanuka::geom {

namespace osd = OpenSubdiv;

struct Cage {
    std::vector<int> first, vertices; // kept faces: corners of face f at first[f] … first[f + 1]
    std::vector<int> sizes;
    std::vector<int> face;         // number of a kept face in the scene
    std::vector<int> corner;       // first corner of a kept face in the scene's facevarying data
    size_t faces = 0, corners = 0; // in the scene
    osd::Sdc::SchemeType scheme = osd::Sdc::SCHEME_CATMARK;
    osd::Sdc::Options options;
    std::vector<int> crease_pairs, corner_vertices, holes;
    std::vector<float> crease_weights, corner_weights;
    // Of a cage that has been refined (subdivision_edits.h): uniform values are the cage's own, face by face,
    // and a face is part of the scene's.
    bool own_uniform = false;
    std::vector<FaceRange> ranges; // empty = whole faces
};
// False where nothing is left.
bool read_cage(const scene::Primitive& primitive, const scene::SubdivisionMesh& mesh,
               const ControlPoints& points, Cage& cage, Journal& journal);

// Face-varying data join where the corners around a vertex have equal values.
struct FaceVaryingChannel {
    std::vector<int> indices;  // one per kept corner
    std::vector<float> values; // per index, `components` floats
    int count = 0;
};
FaceVaryingChannel join_face_varying(const Cage& cage, const Primvar& primvar, size_t points);

// Makes holes of faces at which Bfr (OpenSubdiv 3.5) reads and writes out of bounds, where a mesh that is no
// surface overlaps itself. True if there are any.
bool leave_out_overlaps(Cage& cage, const osd::Far::TopologyLevel& level, const Location& where,
                        Journal& journal);

// Null where OpenSubdiv refuses.
std::unique_ptr<osd::Far::TopologyRefiner> make_refiner(const Cage& cage, size_t points,
                                                        const std::vector<FaceVaryingChannel>& channels);

using FactoryCache =
    osd::Bfr::SurfaceFactoryCacheThreaded<std::shared_mutex, std::shared_lock<std::shared_mutex>,
                                          std::unique_lock<std::shared_mutex>>;
using SurfaceFactory = osd::Bfr::RefinerSurfaceFactory<FactoryCache>;

} // namespace kanuka::geom
