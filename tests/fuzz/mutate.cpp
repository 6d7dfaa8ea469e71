#include "mutate.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace kanuka::fuzz {
namespace {

constexpr const char* Numbers[] = {
    "0",           "-0",         "1",    "-1",         "2",        "0.5",     "1e-30",   "1e-45",
    "1e15",        "-1e15",      "1e19", "1e30",       "-1e30",    "3.4e38",  "-3.4e38", "1e38",
    "nan",         "inf",        "-inf", "1e400",      "65535",    "255",     "1000",    "2147483647",
    "-2147483648", "4294967296", "180",  "360",        "89.99999", "1000000", "3",       "4",
    "7",           "16777217",   "1e-7", "0.99999994", "90",       "1e10",    "0x7f",    "1e20"};

enum class Kind { Space, Number, Text, Word, Mark };
struct Token {
    Kind kind;
    std::string text;
};

bool begins_number(std::string_view s, size_t i) {
    const auto digit = [&](size_t k) {
        return k < s.size() && std::isdigit(static_cast<unsigned char>(s[k]));
    };
    const size_t k = i + (s[i] == '-' || s[i] == '+');
    return digit(k) || (k < s.size() && s[k] == '.' && digit(k + 1));
}

std::vector<Token> tokens_of(std::string_view s) {
    std::vector<Token> all;
    for (size_t i = 0; i < s.size();) {
        const size_t begin = i;
        const auto c = static_cast<unsigned char>(s[i]);
        Kind kind = Kind::Mark;
        if (std::isspace(c)) {
            kind = Kind::Space;
            i++;
            if (c != '\n')
                while (i < s.size() && s[i] == ' ')
                    i++;
        } else if (begins_number(s, i)) {
            kind = Kind::Number;
            for (i++;
                 i < s.size() && (std::isalnum(static_cast<unsigned char>(s[i])) || s[i] == '.' ||
                                  ((s[i] == '-' || s[i] == '+') && (s[i - 1] == 'e' || s[i - 1] == 'E')));)
                i++;
        } else if (c == '"') {
            kind = Kind::Text;
            for (i++; i < s.size() && s[i] != '"';)
                i++;
            i = std::min(i + 1, s.size());
        } else if (std::isalpha(c) || c == '_') {
            kind = Kind::Word;
            while (i < s.size() && (std::isalnum(static_cast<unsigned char>(s[i])) || s[i] == '_'))
                i++;
        } else {
            i++;
        }
        all.push_back({kind, std::string(s.substr(begin, i - begin))});
    }
    return all;
}

std::string number(const std::string& was, Random& random) {
    if (random.one_in(3)) {
        char text[64];
        const double x = std::strtod(was.c_str(), nullptr);
        const double factor[] = {-1, 10, 0.1, 1000, 1e-3, 1e6, 1e-6, 2, 1.0000001};
        std::snprintf(text, sizeof text, "%.9g", x * factor[random.below(std::size(factor))]);
        return text;
    }
    return Numbers[random.below(std::size(Numbers))];
}

// A random token of the kind; its place, or the end.
size_t pick(const std::vector<Token>& all, Kind kind, Random& random) {
    for (int tries = 0; tries < 64 && !all.empty(); tries++)
        if (const size_t i = random.below(all.size()); all[i].kind == kind)
            return i;
    return all.size();
}

// From the token after an opening bracket up to the closing one.
std::pair<size_t, size_t> pick_array(const std::vector<Token>& all, Random& random) {
    for (int tries = 0; tries < 64 && !all.empty(); tries++)
        if (const size_t i = random.below(all.size()); all[i].text == "[") {
            size_t end = i + 1;
            while (end < all.size() && all[end].text != "]")
                end++;
            return {i + 1, end};
        }
    return {all.size(), all.size()};
}

std::pair<size_t, size_t> pick_line(const std::vector<Token>& all, Random& random) {
    size_t begin = random.below(all.size());
    while (begin > 0 && all[begin - 1].text != "\n")
        begin--;
    size_t end = begin;
    while (end < all.size() && all[end].text != "\n")
        end++;
    return {begin, std::min(end + 1, all.size())};
}

void mutate_once(std::vector<Token>& all, std::string_view other, Random& random) {
    if (all.empty())
        return;
    const auto at = [&](size_t i) { return all.begin() + std::ptrdiff_t(i); };
    switch (random.below(12)) {
    default: // numbers most of all
        if (const size_t i = pick(all, Kind::Number, random); i < all.size())
            all[i].text = number(all[i].text, random);
        break;
    case 0: { // two tokens of a kind change places
        const size_t i = random.below(all.size()), j = pick(all, all[i].kind, random);
        if (j < all.size())
            std::swap(all[i], all[j]);
        break;
    }
    case 1: { // an array is cut, or grows
        const auto [begin, end] = pick_array(all, random);
        if (begin >= end)
            break;
        const size_t from = begin + random.below(end - begin), to = from + random.below(end - from) + 1;
        if (random.one_in(3)) {
            const std::vector<Token> copy(at(from), at(to));
            all.insert(at(from), copy.begin(), copy.end());
        } else {
            all.erase(at(from), at(to));
        }
        break;
    }
    case 2: { // a request is repeated
        const auto [begin, end] = pick_line(all, random);
        const std::vector<Token> line(at(begin), at(end));
        const size_t times = random.one_in(8) ? 20 : 1 + random.below(3);
        for (size_t k = 0; k < times && all.size() < 20000; k++)
            all.insert(at(begin), line.begin(), line.end());
        break;
    }
    case 3: { // or left out
        const auto [begin, end] = pick_line(all, random);
        all.erase(at(begin), at(end));
        break;
    }
    case 4: { // or comes from another text
        const std::vector<Token> foreign = tokens_of(other);
        if (foreign.empty())
            break;
        const auto [begin, end] = pick_line(foreign, random);
        all.insert(at(pick_line(all, random).first), foreign.begin() + std::ptrdiff_t(begin),
                   foreign.begin() + std::ptrdiff_t(end));
        break;
    }
    case 5: // a text or word becomes another
        if (const Kind kind = random.one_in(2) ? Kind::Text : Kind::Word; true) {
            const size_t i = pick(all, kind, random), j = pick(all, kind, random);
            if (i < all.size() && j < all.size())
                all[i].text = all[j].text;
        }
        break;
    case 6: { // all numbers of an array
        const auto [begin, end] = pick_array(all, random);
        const std::string same = Numbers[random.below(std::size(Numbers))];
        for (size_t i = begin; i < end; i++)
            if (all[i].kind == Kind::Number)
                all[i].text = same;
        break;
    }
    }
}

} // namespace

void mutate_bytes(std::string& bytes, Random& random, size_t most) {
    for (size_t n = 1 + random.below(8); n > 0 && !bytes.empty(); n--) {
        const size_t at = random.below(bytes.size());
        switch (random.below(8)) {
        case 0:
            bytes[at] = char(bytes[at] ^ (1 << random.below(8)));
            break;
        case 1:
            bytes.insert(at, 1, char(random()));
            break;
        case 2:
            bytes.erase(at, 1 + random.below(random.one_in(4) ? 64 : 4));
            break;
        case 3: {
            const std::string part = bytes.substr(at, 1 + random.below(32));
            if (bytes.size() < most)
                bytes.insert(random.below(bytes.size()), part);
            break;
        }
        case 4:
            bytes[at] = char(random.one_in(2) ? 0xff : 0);
            break;
        case 5: // a whole number of four bytes
            for (size_t k = 0; k < 4 && at + k < bytes.size(); k++)
                bytes[at + k] = char(k < 3 ? 0xff : random.one_in(2) ? 0x7f : 0xff);
            break;
        case 6:
            if (random.one_in(8))
                bytes.resize(at);
            break;
        default:
            bytes[at] = char(random());
        }
    }
}

std::string mutate_text(std::string_view text, std::string_view other, Random& random) {
    std::vector<Token> all = tokens_of(text);
    for (size_t n = 1 + random.below(random.one_in(4) ? 12 : 4); n > 0; n--)
        mutate_once(all, other, random);
    std::string out;
    for (const Token& t : all)
        out += t.text;
    if (random.one_in(6))
        mutate_bytes(out, random);
    return out;
}

} // namespace kanuka::fuzz
