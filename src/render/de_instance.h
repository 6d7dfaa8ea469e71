// Instances that are made as things of their own, where a shader asks where in the world it is: flood lines,
// snow.
#pragma once

#include <map>
#include <memory>

#include "scene/scene.h"

namespace kanuka::render {

// Is each of them diced and shaded where it stands? Those that move are not.
inline bool are_unique(const scene::Group::Instances& in) {
    return in.unique && !in.moves();
}
Transform place_of(const scene::Group::Instances& in, size_t i);
// What instance i differs by, of the list's values.
scene::Variation one_of(const scene::Variation& all, size_t i);
// How many primitives become of all that is unique in the world. `first`: number of the scene's first group.
size_t count_unique(const scene::Scene& scene, size_t first);

// Copies of a group's primitives, at places in the world. Their node is none: what is known of the declared
// primitive (an oracle, why it was made) is not known of them.
class DeInstancer {
  public:
    // At `world_from_group`. Shaders find the variant of `own`, whole or not, as the variable of that name,
    // and its primvars but for those that a primitive has itself.
    std::vector<scene::Primitive> copies(const scene::Group& group, const Transform& world_from_group,
                                         const scene::Variation& own);
    void forget() { m_declared.clear(); } // what copies were made of, once they are prepared
    // Those that a copy's were made of; of all others, themselves. For what is known by address.
    const scene::Attributes* declared(const scene::Attributes* attributes) const;

  private:
    // Keeps all that were made, so that addresses stay theirs.
    std::map<std::shared_ptr<const scene::Attributes>, std::shared_ptr<const scene::Attributes>> m_declared;
};

} // namespace kanuka::render
