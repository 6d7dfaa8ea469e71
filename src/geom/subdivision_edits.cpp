// A path names a face by its number and then children: child k lies at corner k, and keeps the order of its
// parent's corners where that is a quad; the children of other faces begin at their corner. Of a triangle of
// Loop's scheme child 3 is the middle. OpenSubdiv numbers them likewise, so that paths are walked in its
// levels.
#include "geom/subdivision_edits.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "geom/edited_cage.h"

namespace kanuka::geom {
namespace {

constexpr size_t MostFaces = size_t(1) << 22; // of a refined cage

bool is_edit(const std::string& tag) {
    return tag == "vertexedit" || tag == "edgeedit" || tag == "faceedit";
}

class EditReader {
  public:
    EditReader(const scene::Primitive& primitive, const Cage& cage, const Primvars& primvars)
        : m_primitive(primitive), m_cage(cage), m_primvars(primvars) {
        m_triangles = cage.scheme == osd::Sdc::SCHEME_LOOP;
    }

    void read(const scene::SubdivisionMesh::Tag& tag) {
        m_tag = &tag;
        std::vector<Operation> operations;
        if (!read_operations(operations))
            return;
        size_t stride = 0;
        for (const Operation& o : operations)
            stride += size_t(o.width);
        const size_t least = tag.name == "faceedit" ? 1 : 2;
        size_t at = 0, used = 0;
        while (at < tag.ints.size()) {
            const int32_t length = tag.ints[at++];
            if (length < int32_t(least) || size_t(length) > tag.ints.size() - at) {
                bad("a path of " + std::to_string(length) + " where " + std::to_string(least) + " to " +
                    std::to_string(tag.ints.size() - at) + " integers can be; paths begin with their length");
                return;
            }
            if (tag.floats.size() - used < stride) {
                bad("each path takes " + std::to_string(stride) + " floatargs, found " +
                    std::to_string(tag.floats.size()) + " in all");
                return;
            }
            read_path(operations, {tag.ints.data() + at, size_t(length)}, tag.floats.data() + used);
            at += size_t(length);
            used += stride;
        }
    }

    // Those that would need too large a cage.
    void drop_too_deep() {
        m_tag = nullptr;
        std::erase_if(edits, [&](const Edit& e) {
            const size_t levels = e.children.size();
            const bool deep = levels > 0 && double(m_cage.vertices.size()) * std::pow(4.0, levels - 1.0) >
                                                double(MostFaces);
            if (deep)
                bad("level " + std::to_string(levels) + " of a mesh of " +
                    std::to_string(m_cage.sizes.size()) + " faces is too fine");
            return deep;
        });
    }

    void report(Journal& journal) const {
        if (m_bad > 0)
            journal.warning(m_primitive.where,
                            std::to_string(m_bad) +
                                " hierarchical edits were left out, the first of them: " + m_first_bad);
    }

    std::vector<Edit> edits;

  private:
    void bad(const std::string& why) {
        if (m_bad++ == 0)
            m_first_bad = (m_tag ? "\"" + m_tag->name + "\": " : std::string()) + why;
    }

    bool read_operations(std::vector<Operation>& out) {
        const std::vector<std::string>& words = m_tag->strings;
        const bool face = m_tag->name == "faceedit";
        for (size_t i = 0; i < words.size();) {
            if (face && words[i] == "hole") {
                out.push_back({});
                i++;
                continue;
            }
            if (i + 3 > words.size() || (words[i] != "set" && words[i] != "add" && words[i] != "subtract")) {
                bad("found \"" + words[i] + "\" in stringargs; expected set, add or subtract, a name and " +
                    (face ? "value, or hole" : "value or sharpness"));
                return false;
            }
            Operation o;
            o.how = words[i] == "set" ? How::Set : words[i] == "add" ? How::Add : How::Subtract;
            if (!read_target(words[i + 1], words[i + 2], o))
                return false;
            out.push_back(o);
            i += 3;
        }
        if (out.empty())
            bad("it has no stringargs, which say what it does; are there three nargs a tag?");
        return !out.empty();
    }

    bool read_target(const std::string& name, const std::string& kind, Operation& o) {
        const bool face = m_tag->name == "faceedit", edge = m_tag->name == "edgeedit";
        if (kind == "sharpness" && !face) {
            o.what = edge ? What::Crease : What::Corner;
            o.width = 1;
            return true;
        }
        if (kind != "value" || edge) {
            bad("cannot change the \"" + kind + "\"; expected " +
                (edge   ? "sharpness"
                 : face ? "value or hole"
                        : "value or sharpness"));
            return false;
        }
        o.what = face ? What::FaceValue : What::Value;
        if (name == "P" && !face) {
            o.type = scene::Type::Point;
            o.width = 3;
            return true;
        }
        for (size_t k = 0; k < m_primvars.list.size(); k++) {
            const Primvar& p = m_primvars.list[k];
            if (p.name != name || (p.detail == scene::Detail::Uniform) != face)
                continue;
            o.primvar = int(k);
            o.width = p.components;
            if (const scene::Value* v = m_primitive.primvars.find(name))
                o.type = p.target == Primvar::Target::Normal ? scene::Type::Normal : v->type;
            return true;
        }
        bad("there is no primitive variable \"" + name + "\" that varies over " +
            (face ? "faces" : "vertices or corners"));
        return false;
    }

    void read_path(const std::vector<Operation>& operations, std::span<const int32_t> path,
                   const float* values) {
        Edit e;
        const auto kept = std::lower_bound(m_cage.face.begin(), m_cage.face.end(), path[0]);
        if (kept == m_cage.face.end() || *kept != path[0]) {
            bad("there is no face " + std::to_string(path[0]) + "; the mesh has " +
                std::to_string(m_cage.faces));
            return;
        }
        e.face = int(kept - m_cage.face.begin());
        const bool whole_face = m_tag->name == "faceedit";
        int corners = m_cage.sizes[e.face];
        for (const int32_t k : path.subspan(1, path.size() - (whole_face ? 1 : 2))) {
            const int children = m_triangles ? 4 : corners;
            if (k < 0 || k >= children) {
                bad("a face has no child " + std::to_string(k) + "; there are " + std::to_string(children));
                return;
            }
            e.children.push_back(k);
            corners = m_triangles ? 3 : 4;
        }
        if (!whole_face) {
            e.corner = path.back();
            if (e.corner < 0 || e.corner >= corners) {
                bad("a face has no vertex " + std::to_string(e.corner) + "; it has " +
                    std::to_string(corners));
                return;
            }
        }
        for (const Operation& o : operations) {
            const bool finite =
                std::all_of(values, values + o.width, [](float x) { return std::isfinite(x); });
            if (finite) {
                e.operation = o;
                e.values.assign(values, values + o.width);
                edits.push_back(e);
            } else {
                bad("floatargs that are not finite");
            }
            values += o.width;
        }
    }

    const scene::Primitive& m_primitive;
    const Cage& m_cage;
    const Primvars& m_primvars;
    const scene::SubdivisionMesh::Tag* m_tag = nullptr;
    bool m_triangles = false;
    size_t m_bad = 0;
    std::string m_first_bad;
};

} // namespace

bool has_edits(const scene::SubdivisionMesh& mesh) {
    return std::ranges::any_of(mesh.tags, [](const auto& tag) { return is_edit(tag.name); });
}

void apply_edits(const scene::Primitive& primitive, const scene::SubdivisionMesh& mesh,
                 const Transform& page_from_object, Cage& cage, ControlPoints& points, Primvars& primvars,
                 Journal& journal) {
    EditReader reader(primitive, cage, primvars);
    for (const auto& tag : mesh.tags)
        if (is_edit(tag.name))
            reader.read(tag);
    reader.drop_too_deep();
    reader.report(journal);
    std::vector<Edit>& edits = reader.edits;
    if (edits.empty())
        return;
    size_t deepest = 0;
    for (const Edit& e : edits)
        deepest = std::max(deepest, e.children.size());
    Transform inverse;
    if (page_from_object.determinant3() != 0)
        inverse = page_from_object.inverse();
    EditedCage edited(cage, points, primvars);
    edited.begin();
    for (size_t level = 0;; level++) {
        for (const Edit& e : edits)
            if (e.children.size() == level)
                edited.apply(e, page_from_object, inverse);
        edited.end_level();
        if (level == deepest)
            break;
        if (!edited.refine(edits, level)) {
            journal.error(primitive.where, "hierarchical edits were left out: OpenSubdiv refuses the mesh");
            break;
        }
    }
}

} // namespace kanuka::geom
