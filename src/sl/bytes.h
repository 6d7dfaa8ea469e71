// Values to bytes and back: what published shaders and cache entries are made of. Little-endian, as the
// machine is.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace kanuka::sl {

class ByteWriter {
  public:
    template <class T>
    void put(T value) {
        static_assert(std::is_trivially_copyable_v<T>);
        m_bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    // Small for small numbers: seven bits a byte, the lowest first.
    void count(uint64_t n) {
        for (; n >= 128; n >>= 7)
            m_bytes += char(n | 128);
        m_bytes += char(n);
    }
    void text(std::string_view s) {
        count(s.size());
        m_bytes += s;
    }
    template <class T>
    void list(const std::vector<T>& values) {
        count(values.size());
        m_bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    }
    std::string take() { return std::move(m_bytes); }
    size_t size() const { return m_bytes.size(); }

  private:
    std::string m_bytes;
};

// Reads what may be damaged: past the end everything is zero or empty, and ok() is false from then on.
class ByteReader {
  public:
    explicit ByteReader(std::string_view bytes) : m_rest(bytes) {}

    template <class T>
    T get() {
        static_assert(std::is_trivially_copyable_v<T>);
        T value{};
        if (const std::string_view b = take(sizeof value); b.size() == sizeof value)
            std::memcpy(&value, b.data(), sizeof value);
        return value;
    }
    uint64_t count() {
        uint64_t n = 0;
        for (int shift = 0; shift < 64; shift += 7) {
            const uint8_t b = get<uint8_t>();
            n |= uint64_t(b & 127) << shift;
            if (b < 128)
                return n;
        }
        m_ok = false;
        return 0;
    }
    // The number of entries of a list, each at least `size` bytes long: never more than there are bytes for.
    size_t length(size_t size = 1) {
        const uint64_t n = count();
        if (n > m_rest.size() / size) {
            m_ok = false;
            m_rest = {};
            return 0;
        }
        return size_t(n);
    }
    std::string_view text() { return take(length()); }
    template <class T>
    std::vector<T> list() {
        const size_t n = length(sizeof(T));
        std::vector<T> values(n);
        if (const std::string_view b = take(n * sizeof(T)); !b.empty())
            std::memcpy(values.data(), b.data(), b.size());
        return values;
    }
    std::string_view rest() { return take(m_rest.size()); }
    bool ok() const { return m_ok; }
    void fail() { m_ok = false; }
    bool at_end() const { return m_rest.empty(); }

  private:
    std::string_view take(size_t n) {
        if (n > m_rest.size()) {
            m_ok = false;
            m_rest = {};
            return {};
        }
        const std::string_view b = m_rest.substr(0, n);
        m_rest.remove_prefix(n);
        return b;
    }
    std::string_view m_rest;
    bool m_ok = true;
};

} // namespace kanuka::sl
