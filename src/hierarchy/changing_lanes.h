// Leaves of shapes that change: two, as they are when an interval of time begins and when it ends, read as
// one that is in between. Vertices stand on the lattice at both times; between them they are floats, by the
// operations of whoever shades hits (transport/surface_hit.h), a + (b - a) f. So leaves that share a vertex
// at both times agree on it at all, and a ray's origin is taken off after that.
#pragma once

#include "hierarchy/fibre_lanes.h"
#include "hierarchy/triangle_lanes.h"

namespace kanuka::hierarchy {

// Both ends must outlive it.
template <class End>
class ChangingEnds {
  public:
    ChangingEnds(const End& first, const End& last, float fraction)
        : m_first(first), m_last(last), m_fraction(fraction) {}

  protected:
    template <int W>
    Float<W> between(Float<W> a, Float<W> b) const {
        return a + (b - a) * Float<W>(m_fraction);
    }
    // Of steps at both ends. Those are exact, so nothing is rounded before.
    template <int W>
    Float<W> between_places(Float<W> first, Float<W> last) const {
        return between(m_first.place(first, 0.0f), m_last.place(last, 0.0f));
    }
    const End &m_first, &m_last;

  private:
    float m_fraction;
};

// As GridVertices, of such, or of those that are kept.
template <int W, class Vertices>
class ChangingGridVertices : ChangingEnds<Vertices> {
    using Ends = ChangingEnds<Vertices>;
    using Ends::m_first, Ends::m_last, Ends::between_places;

  public:
    using Ends::Ends;
    uint32_t shape() const { return m_first.shape(); }
    Float<W> left(int axis, int s) const {
        return between_places(m_first.left(axis, s), m_last.left(axis, s));
    }
    Float<W> right(int axis, int s) const {
        return between_places(m_first.right(axis, s), m_last.right(axis, s));
    }
    Float<8> last(int axis) const { return between_places(m_first.last(axis), m_last.last(axis)); }
    template <int V>
    Float<V> place(Float<V> p, float o) const {
        return p - Float<V>(o);
    }
};

// As TriangleReader32.
template <class Reader>
class ChangingTriangles : ChangingEnds<Reader> {
    using Ends = ChangingEnds<Reader>;
    using Ends::m_first, Ends::m_last, Ends::between_places;

  public:
    using Ends::Ends;
    uint32_t count() const { return m_first.count(); }
    Float<8> steps(int axis, int corner) const {
        return between_places(m_first.steps(axis, corner), m_last.steps(axis, corner));
    }
    Float<8> place(Float<8> p, float o) const { return p - Float<8>(o); }
};

// As FibreReader32.
template <class Reader>
class ChangingFibres : ChangingEnds<Reader> {
    using Ends = ChangingEnds<Reader>;
    using Ends::m_first, Ends::m_last, Ends::between_places;

  public:
    using Ends::Ends;
    uint32_t segments() const { return m_first.segments(); }
    Float<8> radius(int end) const { return this->between(m_first.radius(end), m_last.radius(end)); }
    Float<8> steps(int axis, int end) const {
        return between_places(m_first.steps(axis, end), m_last.steps(axis, end));
    }
    Float<8> place(Float<8> p, float o) const { return p - Float<8>(o); }
    Float<8> length(Float<8> p) const { return p; }
};

} // namespace kanuka::hierarchy
