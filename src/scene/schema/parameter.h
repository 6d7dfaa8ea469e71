// What a user can set, declared once. A row says what a parameter is called, what it takes and what it does;
// readers of scenes, Python, the command line and the manual derive from it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace kanuka::scene {

struct Value;

// A value on its way in or out, free of the terms of any one door. Flags are 0 or 1.
struct Setting {
    std::vector<double> numbers;
    std::vector<std::string> texts;
    bool operator==(const Setting&) const = default;
};
Setting setting_of(const Value& value);

// Choice: an enumeration; its values are numbered as their names stand in ParameterText::choices.
enum class Kind : uint8_t { Flag, Whole, Number, Text, Choice };

struct Range {
    double least, most;
    bool above = false; // `least` itself is too little
};
inline constexpr double Unbounded = 1e300;
inline constexpr Range AnyNumber{-Unbounded, Unbounded};
inline constexpr Range NotNegative{0, Unbounded};
inline constexpr Range Positive{0, Unbounded, true};

// What a row says that does not depend on where the value lies.
struct ParameterText {
    const char* name;      // of Python, JSON and, with hyphens, the command line
    const char* rib = "";  // "category:name" of Option, or Attribute; "" = a request of its own says it
                           // (of cameras and lights: see there)
    const char* flag = ""; // of the command line, without hyphens before it; "" = none
    const char* about = "";
    const char* unit = "";
    Range range = AnyNumber;
    const char* choices = ""; // of a text, parted by blanks; empty = any
    const char* since = "0.1";
    // What no range can say; of values of the right kind, number and range.
    std::optional<std::string> (*fault)(const Setting& value) = nullptr;
    bool spectrum = false; // a text that names a light or spectrum
    bool file = false;     // a text that names a file
    bool spreads = false;  // one number stands for all
    bool optional = false; // nothing is a value too
    bool links = false;    // of objects and lights
};

struct ParameterInfo : ParameterText {
    Kind kind;
    int count; // of values; 0 = any number of them

    // "a whole number from 0 to 1000", "3 numbers", "full, classic or auto".
    std::string expected() const;
    // Why the value cannot be taken, as "NAME: expected …, got …"; nothing = it can.
    std::optional<std::string> refused(const Setting& value) const;
    bool takes(const Setting& value) const { return !refused(value); }

  protected: // of a Choice
    Setting named(const Setting& number) const;
    Setting numbered(const Setting& name) const;
    Setting spread(const Setting& value) const; // of ParameterText::spreads
};

// Reads and writes a value where it lies. Made by `at`.
template <class Of>
struct Place {
    Kind kind;
    int count;
    void (*get)(const Of&, Setting&);
    void (*set)(Of&, const Setting&); // of the right kind, number and range
};

template <class Of>
class Parameter : public ParameterInfo {
  public:
    Parameter(const ParameterText& text, const Place<Of>& at)
        : ParameterInfo{text, at.kind, at.count}, m_place(at) {}

    Setting get(const Of& of) const {
        Setting value;
        m_place.get(of, value);
        return kind == Kind::Choice ? named(value) : value;
    }
    // Changes nothing and says why where the value cannot be taken.
    [[nodiscard]] std::optional<std::string> set(Of& of, const Setting& value) const {
        auto fault = refused(value);
        if (!fault)
            put(of, value);
        return fault;
    }
    // What takes() has said yes to.
    void put(Of& of, const Setting& value) const {
        m_place.set(of, kind == Kind::Choice ? numbered(value) : spreads ? spread(value) : value);
    }

  private:
    Place<Of> m_place;
};

namespace schema {

template <class T>
constexpr Kind kind_of() {
    if constexpr (std::is_enum_v<T>)
        return Kind::Choice;
    else if constexpr (std::is_same_v<T, bool>)
        return Kind::Flag;
    else if constexpr (std::is_integral_v<T>)
        return Kind::Whole;
    else if constexpr (std::is_floating_point_v<T>)
        return Kind::Number;
    else
        return Kind::Text;
}

template <class T>
void put(Setting& to, const T& value) {
    if constexpr (std::is_same_v<T, std::string>)
        to.texts.push_back(value);
    else
        to.numbers.push_back(double(value));
}
template <class T>
T take(const Setting& from, size_t i) {
    if constexpr (std::is_same_v<T, std::string>)
        return from.texts[i];
    else if constexpr (std::is_same_v<T, bool>)
        return from.numbers[i] != 0;
    else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>)
        return T(int64_t(from.numbers[i]));
    else
        return T(from.numbers[i]);
}

template <class T>
struct Many { // one value
    using Element = T;
    static constexpr int Count = 1;
    static void get(const T& member, Setting& to) { put(to, member); }
    static void set(T& member, const Setting& from) { member = take<T>(from, 0); }
};
template <class T, int N, class Array>
struct ManyOf {
    using Element = T;
    static constexpr int Count = N;
    static void get(const Array& member, Setting& to) {
        for (int i = 0; i < N; i++)
            put(to, member[size_t(i)]);
    }
    static void set(Array& member, const Setting& from) {
        for (int i = 0; i < N; i++)
            member[size_t(i)] = take<T>(from, size_t(i));
    }
};
template <class T, size_t N>
struct Many<std::array<T, N>> : ManyOf<T, int(N), std::array<T, N>> {};
template <class T, size_t N>
struct Many<T[N]> : ManyOf<T, int(N), T[N]> {};
template <class T>
struct Many<std::optional<T>> { // nothing: no values
    using Element = typename Many<T>::Element;
    static constexpr int Count = Many<T>::Count;
    static void get(const std::optional<T>& member, Setting& to) {
        if (member)
            Many<T>::get(*member, to);
    }
    static void set(std::optional<T>& member, const Setting& from) {
        member.reset();
        if (!from.numbers.empty() || !from.texts.empty())
            Many<T>::set(member.emplace(), from);
    }
};
template <class T>
struct Many<std::vector<T>> {
    using Element = T;
    static constexpr int Count = 0; // any number
    static void get(const std::vector<T>& member, Setting& to) {
        for (const T& value : member)
            put(to, value);
    }
    static void set(std::vector<T>& member, const Setting& from) {
        member.clear();
        for (size_t i = 0; i < std::max(from.numbers.size(), from.texts.size()); i++)
            member.push_back(take<T>(from, i));
    }
};

} // namespace schema

// Where a value lies: At<&Options::seed>::in<Options>(), or in a member, At<&Options::color,
// &ColorOptions::space>. Several members of one type as one value: Together<&Options::width, …>.
template <auto... Path>
struct At {
    template <class Of>
    static constexpr Place<Of> in() {
        using Member = std::remove_cvref_t<decltype((std::declval<Of&>().*....*Path))>;
        using Access = schema::Many<Member>;
        return {schema::kind_of<typename Access::Element>(), Access::Count,
                [](const Of& of, Setting& to) { Access::get((of.*....*Path), to); },
                [](Of& of, const Setting& from) { Access::set((of.*....*Path), from); }};
    }
};
template <auto... Members>
struct Together {
    template <class Of>
    static constexpr Place<Of> in() {
        using T = std::common_type_t<std::remove_cvref_t<decltype(std::declval<Of&>().*Members)>...>;
        return {schema::kind_of<T>(), int(sizeof...(Members)),
                [](const Of& of, Setting& to) { (schema::put(to, of.*Members), ...); },
                [](Of& of, const Setting& from) {
                    size_t i = 0;
                    ((of.*Members = schema::take<T>(from, i++)), ...);
                }};
    }
};

// ---- finding rows

std::vector<std::string_view> words_of(std::string_view text); // parted by blanks
// Is `word` one of the words of `text`?
bool is_word_of(std::string_view word, std::string_view text);

template <class Of>
const Parameter<Of>* find_parameter(std::span<const Parameter<Of>> rows, std::string_view name) {
    const auto row = std::ranges::find_if(rows, [&](const auto& r) { return r.name == name; });
    return row == rows.end() ? nullptr : &*row;
}
// By "category:name", as Option and Attribute have it.
template <class Of>
const Parameter<Of>* find_rib_parameter(std::span<const Parameter<Of>> rows, std::string_view rib_name) {
    const auto row = std::ranges::find_if(rows, [&](const auto& r) { return is_word_of(rib_name, r.rib); });
    return row == rows.end() ? nullptr : &*row;
}
// "space, output, observer": the names that a category has.
template <class Of>
std::string rib_names_of(std::span<const Parameter<Of>> rows, std::string_view category) {
    std::string all;
    for (const auto& row : rows) {
        const std::string_view names = row.rib, first = names.substr(0, names.find(' '));
        if (first.starts_with(category) && first.substr(category.size()).starts_with(':'))
            all += (all.empty() ? "" : ", ") + std::string(first.substr(category.size() + 1));
    }
    return all;
}

} // namespace kanuka::scene
