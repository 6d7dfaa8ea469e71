// Typed values: parameters of shaders, options, attributes, and primvars of primitives are all of this one
// form.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/error.h"
#include "base/vec.h"

namespace kanuka::scene {

enum class Type : uint8_t { Float, Integer, String, Color, Point, Vector, Normal, HPoint, Matrix };
// RenderMan storage classes; one value a primitive, face, parametric corner, vertex, face corner, face
// vertex.
enum class Detail : uint8_t { Constant, Uniform, Varying, Vertex, FaceVarying, FaceVertex };

int components(Type type); // floats an element: 1, 3, 4, 16; strings and integers 1
std::string_view name(Type type);
std::string_view name(Detail detail);

// A read-only array that somebody keeps alive: a vector of ours, or a numpy array. Copies share.
template <class T>
class Buffer {
  public:
    Buffer() = default;
    Buffer(std::vector<T> v) {
        auto owned = std::make_shared<std::vector<T>>(std::move(v));
        m_size = owned->size();
        m_data = {owned, owned->data()};
    }
    Buffer(const T* data, size_t size, std::shared_ptr<const void> owner)
        : m_data(std::move(owner), data), m_size(size) {}
    const T* data() const { return m_data.get(); }
    size_t size() const { return m_size; }
    bool empty() const { return m_size == 0; }
    const T& operator[](size_t i) const { return data()[i]; }
    const T* begin() const { return data(); }
    const T* end() const { return data() + m_size; }

  private:
    std::shared_ptr<const T> m_data; // the first of them; keeps the owner
    size_t m_size = 0;
};

// One named value. Floats hold every numeric type but Integer.
struct Value {
    std::string name;
    Type type = Type::Float;
    Detail detail = Detail::Uniform;
    int array_size = 1; // elements an item: float[3] has 3
    Buffer<float> floats;
    Buffer<int32_t> ints;
    Buffer<std::string> strings;
    Location where; // of its token in the file

    size_t items() const; // how many elements of type[array_size] there are
};

struct ValueList {
    std::vector<Value> values;
    const Value* find(std::string_view name) const; // null = not there
    float get_float(std::string_view name, float fallback) const;
    int get_int(std::string_view name, int fallback) const;
    std::string get_string(std::string_view name, std::string_view fallback) const;
    Rgb get_color(std::string_view name, Rgb fallback) const;
    void set(Value value); // replaces one of the same name
};

} // namespace kanuka::scene
