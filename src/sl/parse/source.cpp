#include "sl/parse/source.h"

#include <algorithm>
#include <numeric>

namespace kanuka::sl {

uint32_t Sources::add(std::string name, std::string text) {
    auto file = std::make_unique<File>();
    file->name = std::move(name);
    // Files of other systems: a byte order mark, carriage returns alone as ends of lines.
    if (text.starts_with("\xef\xbb\xbf"))
        text.erase(0, 3);
    if (text.find('\n') == std::string::npos)
        std::replace(text.begin(), text.end(), '\r', '\n');
    file->text = std::move(text);
    file->line_starts.push_back(0);
    for (size_t i = 0; i < file->text.size(); i++)
        if (file->text[i] == '\n')
            file->line_starts.push_back(i + 1);
    m_files.push_back(std::move(file));
    return uint32_t(m_files.size() - 1);
}

std::string_view Sources::line(Loc at) const {
    if (at.file >= m_files.size() || at.line == 0)
        return {};
    const File& f = *m_files[at.file];
    if (at.line > f.line_starts.size())
        return {};
    std::string_view text = f.text;
    const size_t begin = f.line_starts[at.line - 1];
    const size_t end = std::min(text.find('\n', begin), text.size());
    text = text.substr(begin, end - begin);
    if (!text.empty() && text.back() == '\r')
        text.remove_suffix(1);
    return text;
}

Location Sources::location(Loc at) const {
    if (at.file >= m_files.size())
        return {};
    return {m_files[at.file]->name, int(at.line), int(at.column)};
}

std::string_view Sources::keep(std::string text) {
    return m_kept.emplace_back(std::move(text));
}

void Sources::note_comment(uint32_t file, uint32_t line, std::string_view text) {
    m_files[file]->comments[line] = text;
}

std::string_view Sources::comment(uint32_t file, uint32_t line) const {
    const auto& comments = m_files[file]->comments;
    const auto it = comments.find(line);
    return it == comments.end() ? std::string_view{} : it->second;
}

std::string Diagnostics::excerpt(Loc at) const {
    const std::string_view line = m_sources.line(at);
    if (line.empty())
        return {};
    // A very long line is shown around the place.
    constexpr size_t Width = 160;
    const size_t column = std::min<size_t>(at.column ? at.column - 1 : 0, line.size());
    const size_t first = column > Width / 2 ? column - Width / 2 : 0;
    std::string shown(line.substr(first, Width)), caret;
    for (size_t i = first; i < column; i++)
        caret += line[i] == '\t' ? '\t' : ' ';
    return "\n" + shown + "\n" + caret + "^";
}

void Diagnostics::error(Loc at, const std::string& what) {
    if (m_lenient) {
        if (m_demoted++ == 0)
            warning(at, *m_lenient + what);
        return;
    }
    // A second complaint about the same place is a consequence of the first.
    if (m_errors > 0 && at.file == m_last.file && at.line == m_last.line && at.column == m_last.column)
        return;
    m_last = at;
    if (m_errors++ < MaxErrors)
        m_journal.error(m_sources.location(at), what + excerpt(at));
}

void Diagnostics::tell(Severity severity, Loc at, const std::string& what) {
    const std::string key =
        std::to_string(at.file) + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) + what;
    if (m_errors < MaxErrors && m_warnings.insert(key).second)
        m_journal.report(severity, m_sources.location(at), what + excerpt(at));
}

// Levenshtein's distance, cut off at `limit`.
static size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), size_t(0));
    for (size_t i = 1; i <= a.size(); i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b.size(); j++) {
            const size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
        }
    }
    return row[b.size()];
}

std::string closest(std::string_view name, const std::vector<std::string_view>& candidates) {
    std::string best;
    size_t best_distance = name.size() / 3 + 1;
    if (name.size() > 64)
        return best;
    for (std::string_view c : candidates) {
        if (c.size() > name.size() + best_distance || name.size() > c.size() + best_distance)
            continue;
        const size_t d = edit_distance(name, c);
        if (d <= best_distance && (best.empty() || d < best_distance)) {
            best = c;
            best_distance = d;
        }
    }
    return best;
}

} // namespace kanuka::sl
