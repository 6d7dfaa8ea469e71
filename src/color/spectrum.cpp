#include "color/spectrum.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>

namespace kanuka::color {

namespace {

constexpr bool is_separator(char c) {
    return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r' || c == ':' || c == '=';
}

std::string_view without_comment(std::string_view line) {
    for (size_t i = 0; i < line.size(); i++)
        if (line[i] == '#' || (line[i] == '/' && i + 1 < line.size() && line[i + 1] == '/') ||
            (line[i] == ';' && line.find_first_not_of(" \t") == i))
            return line.substr(0, i);
    return line;
}

// The numbers of a line; false where a word stands in it.
bool numbers_of(std::string_view line, std::vector<double>& out) {
    out.clear();
    const char *p = line.data(), *end = p + line.size();
    while (true) {
        while (p < end && is_separator(*p))
            p++;
        if (p == end)
            return true;
        if (*p == '+')
            p++;
        double v = 0;
        const auto [next, error] = std::from_chars(p, end, v);
        if (error != std::errc() || (next < end && !is_separator(*next)))
            return false;
        out.push_back(v);
        p = next;
    }
}

// IES TM-27-14: <SpectralData wavelength="380">0.001</SpectralData>, anywhere.
SpectrumColumns parse_spdx(std::string_view text, const std::string& name) {
    SpectrumColumns c;
    c.columns.resize(1);
    constexpr std::string_view Tag = "<SpectralData", Key = "wavelength=\"";
    std::vector<double> numbers;
    for (size_t at = text.find(Tag); at != text.npos; at = text.find(Tag, at + 1)) {
        const size_t key = text.find(Key, at), close = text.find('>', at), end = text.find('<', at + 1);
        if (key == text.npos || close == text.npos || end == text.npos || key > close || end < close)
            throw Error({name}, "a SpectralData element has no wavelength or no value");
        const size_t from = key + Key.size(), to = text.find('"', from);
        if (to > close || !numbers_of(text.substr(from, to - from), numbers) || numbers.size() != 1)
            throw Error({name}, "a SpectralData element's wavelength is not a number");
        c.nm.push_back(numbers[0]);
        if (!numbers_of(text.substr(close + 1, end - close - 1), numbers) || numbers.size() != 1)
            throw Error({name}, "a SpectralData element's value is not a number");
        c.columns[0].push_back(numbers[0]);
    }
    return c;
}

void sort_and_check(SpectrumColumns& c, const std::string& name) {
    if (c.nm.empty())
        throw Error({name}, "there are no numbers; a spectrum is lines of a wavelength in nm and a value");
    for (size_t i = 0; i < c.nm.size(); i++) {
        bool finite = std::isfinite(c.nm[i]) && c.nm[i] > 0;
        for (const auto& column : c.columns)
            finite &= std::isfinite(column[i]);
        if (!finite)
            throw Error({name}, "number " + std::to_string(i + 1) +
                                    " of the spectrum is not finite, or its wavelength not above 0");
    }
    if (*std::max_element(c.nm.begin(), c.nm.end()) < 20) // micrometres
        for (double& l : c.nm)
            l *= 1000;
    std::vector<size_t> order(c.nm.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return c.nm[a] < c.nm[b]; });
    SpectrumColumns sorted;
    sorted.columns.resize(c.columns.size());
    for (size_t i : order) {
        if (!sorted.nm.empty() && c.nm[i] == sorted.nm.back())
            throw Error({name}, "the wavelength " + std::to_string(c.nm[i]) + " nm comes twice");
        sorted.nm.push_back(c.nm[i]);
        for (size_t k = 0; k < c.columns.size(); k++)
            sorted.columns[k].push_back(c.columns[k][i]);
    }
    c = std::move(sorted);
}

} // namespace

double Spectrum::at(double lambda, Ends ends) const {
    if (nm.empty() || !(lambda >= nm.front()))
        return ends == Ends::Hold && !nm.empty() ? value.front() : 0;
    if (lambda > nm.back())
        return ends == Ends::Hold ? value.back() : 0;
    const size_t k = size_t(std::upper_bound(nm.begin(), nm.end(), lambda) - nm.begin());
    if (k == nm.size())
        return value.back();
    const double t = (lambda - nm[k - 1]) / (nm[k] - nm[k - 1]);
    return (1 - t) * value[k - 1] + t * value[k];
}

Table Spectrum::table(Ends ends) const {
    Table t;
    for (int i = 0; i < LambdaCount; i++)
        t[i] = float(std::max(at(LambdaMin + i, ends), 0.0));
    return t;
}

SpectrumColumns parse_columns(std::string_view text, const std::string& name) {
    SpectrumColumns c;
    if (text.find("<SpectralData") != text.npos) {
        c = parse_spdx(text, name);
        sort_and_check(c, name);
        return c;
    }
    std::vector<double> numbers;
    int number = 0;
    for (size_t at = 0; at < text.size();) {
        const size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line = without_comment(text.substr(at, end - at));
        at = end + 1;
        number++;
        if (!numbers_of(line, numbers)) {
            if (c.nm.empty()) // a heading
                continue;
            throw Error({name, number}, "expected a wavelength in nm and a value, found \"" +
                                            std::string(line.substr(0, 60)) + "\"");
        }
        if (numbers.empty())
            continue;
        if (numbers.size() < 2)
            throw Error({name, number},
                        "a wavelength without a value; a line holds both, as \"550 0.93\" or \"550,0.93\"");
        if (c.nm.empty())
            c.columns.resize(numbers.size() - 1);
        if (numbers.size() - 1 != c.columns.size())
            throw Error({name, number}, "this line has " + std::to_string(numbers.size()) +
                                            " numbers, the ones before have " +
                                            std::to_string(c.columns.size() + 1));
        c.nm.push_back(numbers[0]);
        for (size_t k = 0; k < c.columns.size(); k++)
            c.columns[k].push_back(numbers[k + 1]);
    }
    sort_and_check(c, name);
    return c;
}

SpectrumColumns read_columns(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    if (in)
        text << in.rdbuf();
    if (!in)
        throw Error({path}, "the spectrum cannot be read");
    return parse_columns(text.str(), path);
}

Spectrum read_spectrum(const std::string& path) {
    return read_columns(path).column(0);
}

double integrate(const Table& s, const Table& curve) {
    double sum = 0;
    for (int i = 0; i < LambdaCount; i++)
        sum += double(s[i]) * curve[i];
    return sum;
}

} // namespace kanuka::color
