// What something holds, as 128 bits: equal content, equal digest, on every machine. Results that are kept are
// known by the digest of what they were made of.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace kanuka {

struct Digest {
    uint64_t high = 0, low = 0;
    auto operator<=>(const Digest&) const = default;
    std::string text() const; // 32 hexadecimal digits
};

// XXH3-128 of all that is put in, in order. Types say what of them counts by an overload of put() beside
// them.
class Digester {
  public:
    Digester();
    ~Digester();
    Digester(const Digester&) = delete;

    template <class... T>
    Digester& operator()(const T&... values) {
        (put(*this, values), ...);
        return *this;
    }
    void bytes(const void* data, size_t size);
    Digest digest() const;

  private:
    struct State;
    std::unique_ptr<State> m_state;
};

// Bits count: -0 and 0 differ.
template <class T>
    requires(std::is_arithmetic_v<T> || std::is_enum_v<T>)
void put(Digester& d, T value) {
    d.bytes(&value, sizeof value);
}
void put(Digester& d, std::string_view text); // with its length, so that neighbours cannot run together
inline void put(Digester& d, const std::string& text) {
    put(d, std::string_view(text));
}
inline void put(Digester& d, const Digest& of) {
    d(of.high, of.low);
}
// Declared before any is defined: they hold each other.
template <class T>
void put(Digester& d, std::span<const T> values);
template <class T>
void put(Digester& d, const std::vector<T>& values);
template <class T, size_t N>
void put(Digester& d, const std::array<T, N>& values);
template <class T, size_t N>
    requires(!std::is_same_v<T, char>)
void put(Digester& d, const T (&values)[N]);
template <class T>
void put(Digester& d, const std::optional<T>& value);
template <class T>
void put(Digester& d, const std::shared_ptr<T>& value);
template <class T>
void put(Digester& d, const std::set<T>& values);
template <class K, class V>
void put(Digester& d, const std::map<K, V>& values);
template <class... T>
void put(Digester& d, const std::variant<T...>& value);

template <class T>
void put(Digester& d, std::span<const T> values) {
    d(uint64_t(values.size()));
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
        d.bytes(values.data(), values.size_bytes());
    else
        for (const T& v : values)
            d(v);
}
template <class T>
void put(Digester& d, const std::vector<T>& values) {
    d(std::span<const T>(values));
}
template <class T, size_t N>
void put(Digester& d, const std::array<T, N>& values) {
    d(std::span<const T>(values));
}
template <class T, size_t N>
    requires(!std::is_same_v<T, char>)
void put(Digester& d, const T (&values)[N]) {
    d(std::span<const T>(values, N));
}
template <class T>
void put(Digester& d, const std::optional<T>& value) {
    d(value.has_value());
    if (value)
        d(*value);
}
template <class T>
void put(Digester& d, const std::shared_ptr<T>& value) { // what it points at
    d(value != nullptr);
    if (value)
        d(*value);
}
template <class T>
void put(Digester& d, const std::set<T>& values) {
    d(uint64_t(values.size()));
    for (const T& v : values)
        d(v);
}
template <class K, class V>
void put(Digester& d, const std::map<K, V>& values) {
    d(uint64_t(values.size()));
    for (const auto& [k, v] : values)
        d(k, v);
}
template <class... T>
void put(Digester& d, const std::variant<T...>& value) {
    d(uint64_t(value.index()));
    std::visit([&](const auto& v) { d(v); }, value);
}

template <class... T>
Digest digest_of(const T&... values) {
    return Digester()(values...).digest();
}

} // namespace kanuka
