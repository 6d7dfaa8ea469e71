#include "shade/ies.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

namespace kanuka::shade {

namespace {

constexpr size_t MostAngles = 4096, MostBytes = size_t(16) << 20;
constexpr int Rows = 360, Columns = 360; // of the table: half a degree, one degree

class Reader {
  public:
    Reader(std::string_view text, const std::string& file) : m_text(text), m_file(file) {}

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(m_file + ":" + std::to_string(m_line) + ": " + what);
    }
    bool next_line(std::string_view& line) {
        if (m_at >= m_text.size())
            return false;
        const size_t end = std::min(m_text.find('\n', m_at), m_text.size());
        line = m_text.substr(m_at, end - m_at);
        if (!line.empty() && line.back() == '\r')
            line.remove_suffix(1);
        m_at = end + 1;
        m_line = ++m_consumed;
        return true;
    }
    // Numbers are parted by blanks, commas and line ends, wherever those fall.
    float number(const char* what) {
        while (m_at < m_text.size() && blank(m_text[m_at]))
            m_consumed += m_text[m_at++] == '\n';
        m_line = m_consumed + 1;
        if (m_at >= m_text.size())
            fail(std::string("the file ends where ") + what + " should be");
        const char* begin = m_text.data() + m_at;
        const char* end = m_text.data() + m_text.size();
        if (*begin == '+')
            begin++;
        float value = 0;
        const auto [stop, error] = std::from_chars(begin, end, value);
        if (error != std::errc() || (stop != end && !blank(*stop)) || !std::isfinite(value)) {
            const size_t length = std::min(m_text.find_first_of(" \t\r\n,", m_at), m_text.size()) - m_at;
            fail(std::string(what) + " should be a number; found \"" +
                 std::string(m_text.substr(m_at, std::min<size_t>(length, 40))) + "\"");
        }
        m_at = size_t(stop - m_text.data());
        return value;
    }
    size_t count(const char* what) {
        const float n = number(what);
        if (!(n >= 1) || n > float(MostAngles) || n != std::floor(n))
            fail(std::string(what) + " should be a whole number from 1 to " + std::to_string(MostAngles));
        return size_t(n);
    }
    std::vector<float> angles(size_t n, const char* what) {
        std::vector<float> list(n);
        for (size_t i = 0; i < n; i++) {
            list[i] = number(what);
            if (i > 0 && !(list[i] > list[i - 1]))
                fail(std::string(what) + " must rise from one to the next");
        }
        return list;
    }

  private:
    static bool blank(char c) {
        return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '\0';
    }

    std::string_view m_text;
    const std::string& m_file;
    size_t m_at = 0;
    int m_consumed = 0, m_line = 0; // whole lines that lie behind; the one that is read
};

// Where a value lies among rising ones: cell and fraction.
std::pair<size_t, float> place_of(const std::vector<float>& rising, float x) {
    if (rising.size() < 2 || x <= rising.front())
        return {0, 0.0f};
    if (x >= rising.back())
        return {rising.size() - 2, 1.0f};
    const size_t i = size_t(std::upper_bound(rising.begin(), rising.end(), x) - rising.begin()) - 1;
    return {i, (x - rising[i]) / (rising[i + 1] - rising[i])};
}

// Keywords, up to the tilt.
void read_keywords(Reader& r) {
    std::string_view line;
    bool tilt = false;
    while (!tilt && r.next_line(line)) {
        const size_t start = std::min(line.find_first_not_of(" \t"), line.size());
        if (line.substr(start, 5) != "TILT=")
            continue;
        tilt = true;
        const std::string_view kind = line.substr(start + 5, line.find_last_not_of(" \t") + 1 - start - 5);
        if (kind == "INCLUDE") { // a lamp's output by its tilt: read past, as it hangs here as measured
            r.number("the lamp's orientation to the luminaire");
            const size_t pairs = r.count("the number of tilt angles");
            for (size_t i = 0; i < 2 * pairs; i++)
                r.number("a tilt angle or its factor");
        } else if (kind != "NONE")
            r.fail("TILT=" + std::string(kind.substr(0, 40)) +
                   ": tilt files are not read; write TILT=NONE or TILT=INCLUDE");
    }
    if (!tilt)
        r.fail("no line starts with TILT=; is this an IES LM-63 photometric file?");
}

// Luminous intensities by direction, column after column.
struct Luminaire {
    std::vector<float> vertical, horizontal; // degrees
    std::vector<float> candela;
    float peak = 0;
};

Luminaire read_luminaire(Reader& r) {
    r.number("the number of lamps");
    r.number("lumens per lamp");
    const float multiplier = r.number("the candela multiplier");
    const size_t rows = r.count("the number of vertical angles"),
                 columns = r.count("the number of horizontal angles");
    const float type = r.number("the photometric type");
    if (type != 1)
        r.fail("photometric type " + std::to_string(int(std::clamp(type, -99.0f, 99.0f))) +
               " (B or A, of floodlights and headlamps) is not read; type C (1) is");
    r.number("the type of units");
    for (const char* size : {"the luminaire's width", "the luminaire's length", "the luminaire's height"})
        r.number(size);
    const float ballast = r.number("the ballast factor");
    r.number("the factor for future use");
    r.number("input watts");
    Luminaire of;
    of.vertical = r.angles(rows, "vertical angles");
    of.horizontal = r.angles(columns, "horizontal angles");
    if (of.vertical.front() < 0 || of.vertical.back() > 180)
        r.fail("vertical angles must lie from 0 to 180 degrees");
    if (of.horizontal.front() < 0 || of.horizontal.back() > 360)
        r.fail("horizontal angles must lie from 0 to 360 degrees");
    if (rows * columns > size_t(1) << 22)
        r.fail("more than 4 million values are not read");
    of.candela.resize(rows * columns);
    for (float& c : of.candela)
        c = std::max(r.number("candela values") * multiplier * ballast, 0.0f);
    of.peak = *std::max_element(of.candela.begin(), of.candela.end());
    if (!(of.peak > 0) || !std::isfinite(of.peak))
        r.fail("no candela value is more than 0");
    return of;
}

// A lattice of all directions. What is not given mirrors what is (LM-63-2002, 5.14): up to 90 degrees it
// holds for each quadrant, up to 180 for both halves.
std::shared_ptr<const scene::LightTable> table_of(const Luminaire& of) {
    const size_t rows = of.vertical.size(), columns = of.horizontal.size();
    auto table = std::make_shared<scene::LightTable>();
    const float last = of.horizontal.back();
    table->width = columns == 1 ? 1 : Columns;
    table->height = Rows;
    table->angle = Pi;
    table->rgb.reserve(size_t(table->width) * Rows * 3);
    for (int j = 0; j < Rows; j++) {
        const float theta = 180 * (float(j) + 0.5f) / Rows;
        const bool measured = theta >= of.vertical.front() - 0.25f && theta <= of.vertical.back() + 0.25f;
        const auto [v, fv] = place_of(of.vertical, theta);
        for (int i = 0; i < table->width; i++) {
            float phi = columns == 1 ? of.horizontal[0] : 360 * (float(i) + 0.5f) / float(table->width);
            if (last <= 180 && phi > 180)
                phi = 360 - phi;
            if (last <= 90 && phi > 90)
                phi = 180 - phi;
            const auto [h, fh] = place_of(of.horizontal, phi);
            const auto at = [&](size_t a, size_t b) {
                return of.candela[std::min(a, columns - 1) * rows + std::min(b, rows - 1)];
            };
            const float low = at(h, v) + fv * (at(h, v + 1) - at(h, v)),
                        high = at(h + 1, v) + fv * (at(h + 1, v + 1) - at(h + 1, v));
            table->rgb.insert(table->rgb.end(), 3, measured ? (low + fh * (high - low)) / of.peak : 0.0f);
        }
    }
    return table;
}

} // namespace

std::shared_ptr<const scene::LightTable> parse_ies(std::string_view text, const std::string& file) {
    Reader r(text, file);
    if (text.size() > MostBytes)
        r.fail("a photometric file of more than 16 MiB is not read");
    read_keywords(r);
    return table_of(read_luminaire(r));
}

std::shared_ptr<const scene::LightTable> read_ies(const std::string& file, const Location& asker,
                                                  Journal& journal) {
    try {
        std::ifstream in(file, std::ios::binary);
        if (!in)
            throw Error(file + ": it cannot be opened");
        std::string text;
        text.reserve(1 << 16);
        for (std::istreambuf_iterator<char> c(in), end; c != end && text.size() <= MostBytes; ++c)
            text.push_back(*c);
        return parse_ies(text, file);
    } catch (const Error& e) {
        journal.error(asker, std::string("the light's profile is left out: ") + e.what());
        return nullptr;
    }
}

} // namespace kanuka::shade
