// Why primitives are diced and shaded again, where a session makes its scene again.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/digest.h"
#include "base/error.h"
#include "scene/scene.h"
#include "shade/shade.h"
#include "shade/spaces.h"

namespace kanuka::render {

// What a page is made of, part by part: its key is the digest of all but what is read.
struct PageInputs {
    Digest options, rates, lens; // of what all primitives have in common
    Digest shape, place, cameras, oracle;
    bool inside_out = false;
    uint64_t material = 0; // shade::Material::hash()
    std::shared_ptr<const scene::Attributes> attributes;
    Digest of_attributes;
    shade::SpacesRead read;      // what shaders read of where it stands
    std::vector<Digest> of_read; // the values of that, one by one

    Digest content() const;
    void note_read(const shade::SpacesRead& what, const shade::Material& here);
};

// Thread safety: reasons_for() may run at the same time, the others alone.
class MadeAgain {
  public:
    struct Reason {
        std::string why;         // "shape", "surface parameter roughness", "texture wood.tx", …
        uint64_t primitives = 0; // one that has several reasons counts for each
        std::string name;        // of the first of them
        int id = 0;
        Location where;
    };

    // A making begins. `all`: why nothing of the last one is of use; empty = it may be.
    void begin(std::string all = "");
    // Of what is made now, and was not before or is of other inputs. Primitives are known by their nodes: ids
    // of what is read on demand go by the order in which rays have met it.
    std::vector<std::string> reasons_for(const scene::Primitive& primitive, const PageInputs& now,
                                         const shade::Material& here, bool had_no_room) const;
    // In the order of primitives. Without reasons: it was kept.
    void note(const scene::Primitive& primitive, PageInputs now, const std::vector<std::string>& reasons);
    const std::vector<Reason>& reasons() const { return m_reasons; }

  private:
    static constexpr size_t MostReasons = 256; // that differ; others count as "other"
    struct Known {
        std::string name;
        PageInputs inputs;
        uint64_t making; // number of the last that had it
    };
    std::map<uint64_t, Known> m_known;     // what makings have not had for a while is forgotten
    std::map<std::string, size_t> m_place; // among the reasons
    std::vector<Reason> m_reasons;
    std::string m_all;
    bool m_is_first = true;
    uint64_t m_making = 0;
};

} // namespace kanuka::render
