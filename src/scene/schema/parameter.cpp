#include "scene/schema/parameter.h"

#include <cmath>
#include <cstdio>
#include <limits>

#include "scene/values.h"

namespace kanuka::scene {

namespace {

std::string text_of(double x) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, x == std::floor(x) && std::abs(x) < 1e15 ? "%.0f" : "%.7g", x);
    return buffer;
}

std::string text_of(const Setting& value) {
    std::string all;
    for (const double x : value.numbers)
        all += (all.empty() ? "" : ", ") + text_of(x);
    for (const std::string& text : value.texts)
        all += (all.empty() ? "\"" : ", \"") + text + "\"";
    return all.empty() ? "nothing" : all;
}

// "full, classic or auto"
std::string alternatives(const std::vector<std::string_view>& names) {
    std::string all;
    for (size_t i = 0; i < names.size(); i++)
        all += (i == 0 ? "" : i + 1 < names.size() ? ", " : " or ") + std::string(names[i]);
    return all;
}

std::string range_of(const Range& r) {
    const bool least = r.least > -Unbounded, most = r.most < Unbounded;
    if (least && most)
        return (r.above ? " above " : " from ") + text_of(r.least) + (r.above ? " and at most " : " to ") +
               text_of(r.most);
    if (least)
        return (r.above ? " above " : ", ") + text_of(r.least) + (r.above ? "" : " or more");
    return most ? ", " + text_of(r.most) + " or less" : "";
}

bool lies_in(double x, const Range& r) {
    return (r.above ? x > r.least : x >= r.least) && x <= r.most;
}

} // namespace

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> all;
    while (!text.empty()) {
        const size_t end = std::min(text.find(' '), text.size());
        if (end > 0)
            all.push_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return all;
}

bool is_word_of(std::string_view word, std::string_view text) {
    return std::ranges::count(words_of(text), word) > 0;
}

Setting setting_of(const Value& value) {
    Setting s;
    if (value.type == Type::String)
        s.texts.assign(value.strings.begin(), value.strings.end());
    else if (!value.floats.empty())
        s.numbers.assign(value.floats.begin(), value.floats.end());
    else
        s.numbers.assign(value.ints.begin(), value.ints.end());
    return s;
}

std::string ParameterInfo::expected() const {
    const std::string plural = count == 1 ? "" : "s";
    const std::string before = count == 1 ? "a " : count == 0 ? "" : std::to_string(count) + " ";
    const std::string in_unit = *unit ? (" of " + std::string(unit)) : "";
    switch (kind) {
    case Kind::Flag:
        return "true or false (1 or 0)";
    case Kind::Whole:
        return before + "whole number" + plural + in_unit + range_of(range);
    case Kind::Number:
        return before + "number" + plural + in_unit + range_of(range);
    case Kind::Text:
    case Kind::Choice:
        return *choices ? alternatives(words_of(choices)) : before + "text" + plural;
    }
    return "";
}

std::optional<std::string> ParameterInfo::refused(const Setting& value) const {
    const bool textual = kind == Kind::Text || kind == Kind::Choice;
    const size_t given = textual ? value.texts.size() : value.numbers.size();
    bool fits = (textual ? value.numbers.empty() : value.texts.empty()) &&
                (count == 0 || given == size_t(count) || (spreads && given == 1) || (optional && given == 0));
    constexpr double largest = std::numeric_limits<float>::max();
    for (const double x : value.numbers) {
        fits = fits && std::abs(x) <= largest && (kind == Kind::Flag || lies_in(x, range));
        fits = fits && (kind != Kind::Whole || x == std::floor(x));
    }
    if (*choices)
        for (const std::string& text : value.texts)
            fits = fits && is_word_of(text, choices);
    const auto wrong = [&](const std::string& needs) { return std::string(name) + ": expected " + needs; };
    if (!fits)
        return wrong(expected() + ", got " + text_of(value));
    if (fault)
        if (const auto found = fault(value))
            return std::string(name) + ": " + *found;
    return std::nullopt;
}

Setting ParameterInfo::named(const Setting& number) const {
    return {{}, {std::string(words_of(choices)[size_t(number.numbers[0])])}};
}
Setting ParameterInfo::numbered(const Setting& name_of) const {
    const auto all = words_of(choices);
    return {{double(std::ranges::find(all, name_of.texts[0]) - all.begin())}, {}};
}

Setting ParameterInfo::spread(const Setting& value) const {
    return value.numbers.size() == 1 ? Setting{std::vector<double>(size_t(count), value.numbers[0]), {}}
                                     : value;
}

} // namespace kanuka::scene
