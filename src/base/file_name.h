// The name of a file in locations. Every value and primitive of a scene has a location, so that millions say
// the same name: it is kept once, for as long as the process runs, and a FileName points to it.
#pragma once

#include <compare>
#include <concepts>
#include <string>
#include <string_view>

namespace kanuka {

// Thread safety: all members may be called from any thread. Making one from text takes a lock and a search:
// whoever makes many locations makes the name once.
class FileName {
  public:
    FileName() = default; // empty
    template <std::convertible_to<std::string_view> Text>
    FileName(const Text& text) : m_text(kept(text)) {}
    const std::string& str() const { return m_text ? *m_text : Empty; }
    operator const std::string&() const { return str(); }
    bool empty() const { return !m_text; }
    friend bool operator==(FileName, FileName) = default; // the same text is the same place
    template <std::convertible_to<std::string_view> Text>
    friend bool operator==(FileName a, const Text& b) {
        return a.str() == std::string_view(b);
    }
    friend std::strong_ordering operator<=>(FileName a, FileName b) { return a.str() <=> b.str(); }

  private:
    static const std::string* kept(std::string_view text); // null = empty
    static const std::string Empty;
    const std::string* m_text = nullptr;
};

} // namespace kanuka
