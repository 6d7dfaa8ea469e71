// How finely to dice, as seen from the dicing camera.
#pragma once

#include <optional>

#include "dice/dice.h"
#include "geom/traced_mesh.h"

namespace kanuka::dice {

// Thread safety: const members may run at the same time.
class Density final : public geom::Viewpoint {
  public:
    Density(const DiceTarget& target, const DiceOptions& options, float shading_rate);

    // Pixels a unit of the page's space spans at p, seen face on.
    float pixels_per_unit(const Vec3f& p) const override;
    bool has_camera() const override { return !m_instanced; }
    double most_vertices() const override { return m_most; }
    // Micropolygon edges that fit between two near points; foreshortened as the camera sees them, and as an
    // oracle wants them (DiceTarget::field).
    float cells(const Vec3f& a, const Vec3f& b) const override;
    // The same from each of a line's points to the next: count - 1 values. At most MostPoints.
    static constexpr int MostPoints = 16;
    void cells(const Vec3f* points, int count, float* out) const;
    // The same of `count` pairs, component by component: a[c * stride + i] to b[c * stride + i].
    void cells(const float* a, const float* b, int stride, int count, float* out) const;
    // Micropolygons that fit into a triangle.
    float area(const Vec3f& a, const Vec3f& b, const Vec3f& c) const;
    // Direction from p to the camera, not normalised; towards the viewer for orthographic cameras.
    Vec3f towards_camera(const Vec3f& p) const override;
    void coarsen(float factor) { m_cells_per_pixel *= factor; }
    float edge_pixels() const override { return 1 / m_cells_per_pixel; }
    float chord_pixels() const override { return m_chord_pixels; }

  private:
    // Where the camera is at one of the times that count: the one with the most pixels decides.
    struct Pose {
        float camera_from_page[3][4];
        float scale = 1;                   // camera units a unit of the page's space, along x
        Vec3f eye{0, 0, 0}, view{0, 0, 1}; // in the page's space
        Vec3f to_camera(const Vec3f& p) const;
    };
    void add_pose(const Transform& page_from_camera);
    // Pixels a camera unit spans, before what is `beyond` the picture takes from it (0 = inside).
    float pixels_at(const Vec3f& camera_point, float& beyond) const;
    // The same for a unit of the page's space, with that.
    float pixels_from(const Pose& pose, const Vec3f& p, float& beyond) const;
    float perspective_at(const Vec3f& camera_point, float& beyond) const;
    float cells_asked(const Vec3f& a, const Vec3f& b) const; // without the oracle
    template <class PixelsAt>
    float cells_between(const Vec3f& a, const Vec3f& b, PixelsAt pixels_at) const;
    float cells_between(const Vec3f& a, const Vec3f& b) const; // points of the camera's
    Vec3f towards(const Pose& pose, const Vec3f& p) const;

    float factor(const Vec3f& p) const { return m_field ? m_field->at(m_object_from_page.point(p)) : 1; }

    const DensityField* m_field;
    Transform m_object_from_page; // where there is a field
    float m_uniform = 0, m_cells_per_pixel = 1, m_chord_pixels = 0.25f;
    float m_stretch = 1; // of camera space along y, after which pixels are square
    double m_most;
    bool m_instanced = false;
    Projection m_projection = Projection::Perspective;
    float m_half_angle = 1;
    float m_by_place = 1, m_everywhere = 0; // of `beyond`: DicingCamera::border
    float m_pixels_per_tangent = 1, m_near = 1e-4f, m_falloff = 1;
    float m_middle_x = 0, m_middle_y = 0, m_half_width = 1, m_half_height = 1,
          m_edge_cosine = 0.5f; // tangents (or units) at the frustum's sides
    std::vector<Pose> m_poses;  // the first is where shading sees it from
};

// Desired cells along a line of points, and whether they are spread too unevenly for equal steps.
struct LineMeasure {
    float cells = 0;
    bool uneven = false;
    bool tiny = false; // within one cell, wherever it is seen from and however it bends
};

// What decides the number of cells. Where the material is uniform and nothing is displaced, only the shape
// counts.
struct RateRule {
    Density density;
    bool shape_only = false;
    float geometry_tolerance = 0.25f; // pixels
    float normal_tolerance = 3;       // degrees
    int max_cells = 32;
    float least_range = FinestRange;                       // of a face's u or v that is cut no more
    static constexpr float FinestRange = 1.0f / (1 << 18); // deeper than any picture needs
    float slack = 1;                                       // times the tolerance, of what was too much
    // Micropolygons `halvings` times twice as long, in the end one grid a face: there are faces that no rate
    // serves, which run from before the eye to where all of the world is a point.
    void coarsen(int halvings, int most);

    // Where there is no tolerance, nothing curved is further off than this all the same.
    float tolerance() const { return slack * (geometry_tolerance > 0 ? geometry_tolerance : 0.25f); }
    // Are micropolygons so long that their chords leave it?
    bool is_coarse() const { return MostSagitta * density.edge_pixels() > tolerance(); }
    // A face turns by a right angle at most: over one cell, a fifth of its length.
    static constexpr float MostSagitta = 0.2f;

    // `unseen`: how many times what it turns at its inner points it turns in all.
    LineMeasure line(const Vec3f* points, int count, float unseen = 1) const;
    // Of three points of a line that makes no arch between them, if it is so short that they tell.
    std::optional<LineMeasure> short_line(const Vec3f* points) const;
    // Of the lengths in cells from each of its points to the next, `step` apart in memory; not for shape
    // alone.
    static LineMeasure line(const float* lengths, int step, int pieces);
    // Cells that a twisted quad (a, b, c, d in cyclic order) needs in either direction, for shape alone.
    float twist(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& d) const;
};

// The power of two nearest to x, at least 1.
int round_to_power(float x);

} // namespace kanuka::dice
