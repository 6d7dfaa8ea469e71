// What counts of a scene where results are kept: see base/digest.h. Places in files, and ids of nodes, do
// not; files that are named count by their names.
#pragma once

#include "base/digest.h"
#include "scene/scene.h"

namespace kanuka {
void put(Digester& d, const Vec3f& v);
void put(Digester& d, const Transform& t);
void put(Digester& d, const TransformKey& key);
template <class T>
void put(Digester& d, const Shared<T>& value) {
    d(*value);
}
} // namespace kanuka

namespace kanuka::scene {

void put(Digester& d, const Value& value);
void put(Digester& d, const ValueList& values);
void put(Digester& d, const ShaderRef& shader);
void put(Digester& d, const Attributes& attributes);
void put(Digester& d, const Primitive& primitive); // but for its attributes, which many share
// Of a primitive what it is in its own space, at all times: not where it stands, nor what it is called.
void put_shape(Digester& d, const Primitive& primitive);
// Of attributes and their shaders all but where shaders stand.
Digest digest_apart(const Attributes& attributes);
void put(Digester& d, const Variation& variation);
void put(Digester& d, const Light& light);
void put(Digester& d, const Camera& camera);
void put(Digester& d, const ColorOptions& color); // but for the display's
// What a picture's samples depend on: not how many there are, nor what becomes of them when they are
// developed.
void put(Digester& d, const Options& options);
// Light sources and all that they are lit by; of the whole scene, not of its shapes.
Digest digest_of_lights(const Scene& scene);

} // namespace kanuka::scene
