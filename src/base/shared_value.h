// A value that many have in common, such as the transformation of all primitives of an object: copies share
// it. It is never changed, only replaced.
#pragma once

#include <memory>
#include <utility>

namespace kanuka {

// Thread safety: as std::shared_ptr.
template <class T>
class Shared {
  public:
    Shared() = default; // T()
    Shared(T value) : m_value(std::make_shared<const T>(std::move(value))) {}
    const T& operator*() const { return m_value ? *m_value : Default; }
    const T* operator->() const { return &**this; }
    operator const T&() const { return **this; }
    friend bool operator==(const Shared& a, const Shared& b) { return &*a == &*b || *a == *b; }
    friend bool operator==(const Shared& a, const T& b) { return *a == b; }

  private:
    static constexpr T Default{};
    std::shared_ptr<const T> m_value; // null = Default
};

} // namespace kanuka
