// A cage while its hierarchical edits are made. Only subdivision_edits.cpp and edited_cage.cpp include this.
#pragma once

#include "geom/subdivision.h"

namespace kanuka::geom {

enum class What { Value, Corner, Crease, Hole, FaceValue };
enum class How { Set, Add, Subtract };

struct Operation {
    What what = What::Hole;
    How how = How::Set;
    int primvar = -1; // of Primvars::list; -1 = P
    scene::Type type = scene::Type::Float;
    int width = 0; // floats
};

struct Edit {
    Operation operation;
    int face = 0; // of the cage at the level that has been reached
    std::vector<int> children;
    int corner = 0; // of that face, of a vertex or of the edge that begins there
    std::vector<float> values;
};

class EditedCage {
  public:
    EditedCage(Cage& cage, ControlPoints& points, Primvars& primvars)
        : m_cage(cage), m_points(points), m_primvars(primvars) {}

    // Face-varying and uniform values in the order of the cage's own faces.
    void begin();
    // To the next level; edits of finer levels go on to the children they name. False: OpenSubdiv refuses.
    bool refine(std::vector<Edit>& edits, size_t level);
    void apply(const Edit& e, const Transform& page_from_object, const Transform& inverse);
    void end_level();

  private:
    void refine_values(const osd::Far::TopologyRefiner& refiner, const osd::Far::TopologyLevel& fine,
                       std::vector<FaceVaryingChannel>& channels);
    void refine_topology(const osd::Far::TopologyLevel& coarse, const osd::Far::TopologyLevel& fine);
    void drop_smooth();
    void know_level();
    void set_crease(int a, int b, How how, float value);
    void set_corner(int vertex, How how, float value);
    void change_value(const Edit& e, int vertex, int corner, const std::vector<float>& values);
    std::vector<float>& writable(size_t primvar);

    Cage& m_cage;
    ControlPoints& m_points;
    Primvars& m_primvars;
    // Where the sharpness of an edge or a vertex is kept, at this level.
    std::map<std::pair<int, int>, size_t> m_crease;
    std::map<int, size_t> m_corner;
    bool m_level_known = false;
    std::map<size_t, std::vector<float>> m_written; // primvars that have been edited, until the level is done
};

} // namespace kanuka::geom
