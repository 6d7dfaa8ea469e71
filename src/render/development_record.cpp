#include "render/development_record.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace kanuka::render {

namespace {

class Packer {
  public:
    std::string bytes;

    template <class T>
        requires std::is_trivially_copyable_v<T>
    void operator()(T& value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void operator()(bool& value) {
        uint8_t byte = value;
        (*this)(byte);
    }
    void operator()(std::string& text) {
        count(text.size());
        bytes += text;
    }
    uint32_t count(size_t n) {
        uint32_t value = uint32_t(n);
        (*this)(value);
        return value;
    }
};

class Unpacker {
  public:
    explicit Unpacker(std::string_view bytes) : m_bytes(bytes) {}
    bool whole() const { return m_good && m_bytes.empty(); }

    template <class T>
        requires std::is_trivially_copyable_v<T>
    void operator()(T& value) {
        if (const std::string_view from = take(sizeof value); !from.empty())
            std::memcpy(&value, from.data(), sizeof value);
    }
    void operator()(bool& value) {
        uint8_t byte = 0;
        (*this)(byte);
        value = byte != 0;
    }
    void operator()(std::string& text) { text = take(count(0)); }
    // Of things that take a byte or more each.
    uint32_t count(size_t) {
        uint32_t value = 0;
        (*this)(value);
        if (value > m_bytes.size())
            m_good = false;
        return m_good ? value : 0;
    }

  private:
    std::string_view take(size_t size) { // empty where there is not so much
        if (size > m_bytes.size())
            m_good = false;
        if (!m_good)
            return {};
        const std::string_view taken = m_bytes.substr(0, size);
        m_bytes.remove_prefix(size);
        return taken;
    }

    std::string_view m_bytes;
    bool m_good = true;
};

template <class Archive, class T, class One>
void visit_all(Archive& archive, std::vector<T>& all, One&& one) {
    all.resize(archive.count(all.size()));
    for (T& each : all)
        one(each);
}

// The one order of what is written and read.
template <class Archive>
void visit(Archive& a, Development& d) {
    a(d.full_width), a(d.full_height), a(d.space), a(d.exposure), a(d.white_luminance);
    a(d.origin), a(d.eye.x), a(d.eye.y), a(d.eye.z), a(d.forward.x), a(d.forward.y), a(d.forward.z);
    a(d.filter_weighted), a(d.imager), a(d.layers.sample_count);
    visit_all(a, d.layers.names, a);
    visit_all(a, d.layers.kinds, [&](Layers::Kind& kind) { a(kind.components), a(kind.color); });
    visit_all(a, d.layers.expressions, a);
    std::vector<std::pair<std::string, std::string>> metadata(d.metadata.begin(), d.metadata.end());
    visit_all(a, metadata, [&](auto& entry) { a(entry.first), a(entry.second); });
    d.metadata = {metadata.begin(), metadata.end()};
    a(d.exposure_gain), a(d.exposure_gamma), a(d.display);
}

} // namespace

std::string packed(const Development& how) {
    Development copy = how;
    Packer packer;
    visit(packer, copy);
    return std::move(packer.bytes);
}

bool unpack(std::string_view bytes, Development& how) {
    Unpacker unpacker(bytes);
    visit(unpacker, how);
    return unpacker.whole() && how.layers.kinds.size() == how.layers.names.size() &&
           how.space <= color::Space::Xyz && how.space >= color::Space::Rec709 &&
           std::ranges::all_of(how.layers.kinds,
                               [](const auto& k) { return k.components >= 0 && k.components <= 3; });
}

} // namespace kanuka::render
