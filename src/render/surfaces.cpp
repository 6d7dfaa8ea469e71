#include "render/surfaces.h"

#include <map>
#include <mutex>

#include "base/tasks.h"
#include "render/geometry.h"
#include "render/weld.h"
#include "scene/counts.h"

namespace kanuka::render {

namespace {

class SurfaceReader {
  public:
    SurfaceReader(const Geometry& geometry, const Albedos& albedos, const scene::Scene& scene,
                  Journal& journal, const Progress& progress)
        : m_geometry(geometry), m_albedos(albedos), m_scene(scene), m_journal(journal), m_progress(progress) {
        name_primitives(scene.primitives);
        for (const scene::Group& g : scene.groups)
            name_primitives(g.primitives);
    }

    std::vector<SurfaceGroup> read(const std::array<double, 3>& world_origin) {
        std::vector<SurfaceGroup> groups(m_geometry.groups.size());
        bool has_solids = false;
        for (size_t g = 0; g < groups.size(); g++) {
            for (const bvh::GroupDesc::Range& range : m_geometry.groups[g].shapes)
                find_primitives(range, g, groups[g]);
            for (const bvh::GroupDesc::Instances& in : m_geometry.groups[g].instances)
                groups[g].instances.push_back({in.group, matrices_of(in)});
            has_solids |= !m_geometry.groups[g].solids.empty();
        }
        groups.back().origin = world_origin;
        for (size_t i = 0; i < m_geometry.levels_of_scene.size(); i++) {
            SurfaceGroup& group = groups[size_t(m_geometry.levels_of_scene[i][0])];
            const Vec3f& c = m_geometry.center_of_scene[i];
            group.origin = {double(c.x), double(c.y), double(c.z)};
            if (i < m_scene.groups.size())
                group.name = m_scene.groups[i].name;
        }
        weld(groups);
        say(has_solids);
        return groups;
    }

  private:
    struct Found {
        size_t group, surface;
        int first, count;
    };

    void name_primitives(const std::vector<scene::Primitive>& primitives) {
        for (const scene::Primitive& p : primitives)
            m_primitives[p.id] = &p;
    }

    // Shapes of a primitive follow each other.
    void find_primitives(const bvh::GroupDesc::Range& range, size_t number, SurfaceGroup& group) {
        const auto& shapes = m_geometry.store.shapes();
        const int end = range.first + range.count;
        for (int first = range.first; first < end;) {
            const int id = shapes[size_t(first)].object_id;
            int next = first + 1;
            while (next < end && shapes[size_t(next)].object_id == id)
                next++;
            const auto known = m_primitives.find(id);
            const scene::Primitive* p = known == m_primitives.end() ? nullptr : known->second;
            const bool volume = p && std::holds_alternative<scene::Volume>(p->geometry);
            const bool fibres = shapes[size_t(first)].flags & store::ShapeRecord::Fibre;
            m_volumes += volume, m_fibres += fibres;
            if (!volume && !fibres) {
                m_found.push_back({number, group.surfaces.size(), first, next - first});
                Surface surface;
                surface.id = id;
                for (int shape = first; shape < next; shape++) {
                    const store::ShapeRecord& s = shapes[size_t(shape)];
                    const bool mesh = s.flags & store::ShapeRecord::Mesh;
                    surface.micropolygons += mesh ? uint64_t(s.mv) : uint64_t(s.nu) * uint64_t(s.nv);
                }
                if (p) {
                    surface.kind = scene::kind_name(p->geometry);
                    surface.name = p->attributes ? p->attributes->name : "";
                }
                group.surfaces.push_back(std::move(surface));
            }
            first = next;
        }
    }
    static std::vector<float> matrices_of(const bvh::GroupDesc::Instances& in) {
        std::vector<float> all;
        all.reserve(12 * std::max(in.places.size(), in.paths.size()));
        for (size_t i = 0; i < in.places.size(); i++) {
            const std::array<float, 12> m = in.places[i];
            all.insert(all.end(), m.begin(), m.end());
        }
        for (const MotionPath& path : in.paths) {
            all.resize(all.size() + 12);
            path.at(0, all.data() + all.size() - 12);
        }
        return all;
    }

    void weld(std::vector<SurfaceGroup>& groups) {
        std::mutex mutex;
        size_t done = 0;
        tasks::parallel_for(m_found.size(), [&](size_t i) {
            if (m_progress.cancelled())
                return;
            const Found& found = m_found[i];
            Weld weld(m_geometry.store, m_albedos);
            groups[found.group].surfaces[found.surface].mesh = weld.run(found.first, found.count);
            const std::lock_guard lock(mutex);
            m_nowhere += weld.nowhere();
            m_progress.update("weld", double(++done) / double(m_found.size()));
        });
    }

    void say(bool has_solids) {
        const Location where{m_scene.file};
        const auto left_out = [&](size_t count, const char* what) {
            if (count > 0)
                m_journal.warning(where, std::to_string(count) + what);
        };
        left_out(m_fibres,
                 " primitives of curves or points are round fibres, which have no faces: they are left out");
        left_out(m_nowhere, " faces have a corner that is no number: they are left out");
        left_out(m_volumes, " volumes have no surface: they are left out");
        if (has_solids)
            m_journal.warning(where, "surfaces of solids are whole, with what set operations take away");
        if (m_geometry.moving)
            m_journal.report(Severity::Info, where, "what moves is where it is when the shutter opens");
    }

    const Geometry& m_geometry;
    const Albedos& m_albedos;
    const scene::Scene& m_scene;
    Journal& m_journal;
    const Progress& m_progress;
    std::map<int, const scene::Primitive*> m_primitives; // by id
    std::vector<Found> m_found;
    size_t m_fibres = 0, m_volumes = 0, m_nowhere = 0;
};

} // namespace

std::vector<SurfaceGroup> surfaces_of(const Geometry& geometry, const std::array<double, 3>& world_origin,
                                      const Albedos& albedos, const scene::Scene& scene, Journal& journal,
                                      const Progress& progress) {
    return SurfaceReader(geometry, albedos, scene, journal, progress).read(world_origin);
}

} // namespace kanuka::render
