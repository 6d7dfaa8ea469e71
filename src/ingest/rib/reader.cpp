#include "ingest/rib/reader.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "ingest/rib/handlers.h"
#include "ingest/rib/search_path.h"

namespace kanuka::ingest {

Reader::Reader(Journal& journal, FrameChoice frame, const RibOptions& options, const Source& scene)
    : m_extra_path(options.archive_path),
      m_context(*this, m_declarations, journal, frame, folder_of(scene.name()), options.archive_path) {
    m_context.rib_options = options;
}

std::string Reader::folder() const {
    return m_lexer ? folder_of(m_lexer->source()->name()) : "";
}

void Reader::run(const std::shared_ptr<const Source>& source) {
    constexpr std::string_view ByteOrderMark = "\xEF\xBB\xBF";
    const size_t begin = source->text().substr(0, 3) == ByteOrderMark ? 3 : 0;
    Lexer lexer(source, begin, source->text().size());
    run(lexer);
}

void Reader::run(Lexer& lexer) {
    Lexer* const outer = m_lexer;
    m_lexer = &lexer;
    if (!outer)
        m_outermost_lexer = &lexer;
    lexer.is_request = [](std::string_view word) { return find_request(word) != nullptr; };
    std::vector<Lexer::Comment> outer_comments = std::exchange(m_comments, {});
    if (m_sink || m_listener)
        lexer.comments = &m_comments;
    while (!m_stopped) {
        const Token token = lexer.peek();
        pass_comments(lexer.offset());
        if (token == Token::End)
            break;
        if (token == Token::Word) {
            lexer.source()->passed(lexer.offset());
            request();
            continue;
        }
        m_context.reports.error("stray token", lexer.where(),
                                "expected a request, found " + found() +
                                    "; reading goes on at the next request");
        resynchronise();
    }
    pass_comments(lexer.end());
    m_comments = std::move(outer_comments);
    m_lexer = outer;
    if (!outer)
        m_outermost_lexer = nullptr;
}

void Reader::resume(const std::string& file, const std::function<void()>& work) {
    const std::shared_ptr<const Source> nothing = Source::from_text("", file);
    Lexer lexer(nothing, 0, 0);
    m_lexer = &lexer;
    m_outermost_lexer = &lexer;
    m_stopped = false; // the end of a frame stops reading
    work();
    m_lexer = nullptr;
    m_outermost_lexer = nullptr;
}

double Reader::progress() const {
    return m_outermost_lexer && m_outermost_lexer->end() > 0
               ? double(m_outermost_lexer->position()) / double(m_outermost_lexer->end())
               : 1;
}

void Reader::pass_comments(size_t before) {
    size_t passed = 0;
    for (; passed < m_comments.size() && m_comments[passed].begin < before; passed++) {
        const std::string_view text = m_lexer->source()->text().substr(
            m_comments[passed].begin, m_comments[passed].end - m_comments[passed].begin);
        if (m_sink)
            m_sink->comment(text);
        else if (text.starts_with("##"))
            tell("structure", std::string(text.substr(2)));
        else
            tell("comment", std::string(text.substr(1)));
    }
    m_comments.erase(m_comments.begin(), m_comments.begin() + long(passed));
}

// A listener's own calls are a program's: no file is being read while it makes them.
void Reader::tell(const char* type, const std::string& text) {
    const RecordListener listener = m_listener;
    if (!listener)
        return;
    Lexer* const lexer = std::exchange(m_lexer, nullptr);
    const Lexer* const outermost = std::exchange(m_outermost_lexer, nullptr);
    std::vector<Lexer::Comment> comments = std::exchange(m_comments, {});
    listener(type, text);
    m_comments = std::move(comments);
    m_lexer = lexer;
    m_outermost_lexer = outermost;
}

// A request that nobody knows, as it stands in the file up to the next request or comment.
void Reader::tell_unknown(size_t begin) {
    resynchronise();
    size_t end = m_lexer->position();
    for (const Lexer::Comment& comment : m_comments)
        if (comment.begin > begin)
            end = std::min(end, comment.begin);
    std::string_view text = m_lexer->source()->text().substr(begin, end - begin);
    text = text.substr(0, text.find_last_not_of(" \t\r\n") + 1);
    tell("verbatim", std::string(text));
}

void Reader::request() {
    const size_t offset = m_lexer->offset();
    const std::string_view word = m_lexer->word();
    // Files say the same again and again.
    const RequestSpec* spec = m_call.spec && m_call.spec->name == word ? m_call.spec : find_request(word);
    m_call.spec = spec;
    m_call.where = m_lexer->where(offset);
    if (m_request != word)
        m_request = word;
    if (!spec) {
        // What a binary code stands for is no text of the file.
        if (m_listener && !word.empty() && m_lexer->source()->text().substr(offset).starts_with(word))
            tell_unknown(offset);
        else
            unknown_request(word);
        return;
    }
    if (!read_arguments(m_call) || !read_parameters(m_call)) {
        resynchronise();
        return;
    }
    const Token next = m_lexer->peek();
    if (next != Token::Word && next != Token::End) {
        m_context.reports.error("surplus arguments", m_lexer->where(),
                                m_request + ": expected the next request, found " + found() +
                                    "; it takes: " + spec->usage());
        resynchronise();
    }
    if (m_sink) {
        pass_comments(m_lexer->space_begin());
        m_sink->call(m_call);
        return;
    }
    if (m_listener && spec->name == "ArchiveRecord") {
        tell(std::string(m_call.text(0)).c_str(), std::string(m_call.text(1)));
        return;
    }
    m_context.execute(m_call);
}

void Reader::unknown_request(std::string_view word) {
    const std::string_view nearest = nearest_request(word);
    m_context.reports.once(Severity::Error, "unknown request " + m_request, m_call.where,
                           "unknown request " + m_request + " was left out" +
                               (nearest.empty() ? "" : "; did you mean " + std::string(nearest) + "?"));
    if (m_sink && !word.empty()) // a code may be defined as no name at all, which no text can say
        m_sink->unknown(word, *m_lexer);
    resynchronise();
}

// To the next word that is a request or looks like one (a capital first letter).
void Reader::resynchronise() {
    for (;;) {
        m_lexer->clear_unterminated();
        const Token token = m_lexer->peek();
        if (token == Token::End)
            return;
        if (token == Token::Word) {
            const size_t offset = m_lexer->offset();
            const std::string_view word = m_lexer->word();
            if (find_request(word) || (!word.empty() && std::isupper(static_cast<unsigned char>(word[0])))) {
                m_lexer->seek(offset);
                return;
            }
            continue;
        }
        m_lexer->skip();
    }
}

std::string Reader::found() {
    switch (m_lexer->peek()) {
    case Token::End:
        return "the end of the file";
    case Token::Word: {
        const size_t offset = m_lexer->offset();
        std::string word(m_lexer->word());
        m_lexer->seek(offset);
        return (find_request(word) ? "the request " : "the word ") + word;
    }
    case Token::Number:
        return "a number";
    case Token::String: {
        const size_t offset = m_lexer->offset();
        std::string text(m_lexer->string());
        m_lexer->seek(offset);
        if (text.size() > 40)
            text = text.substr(0, 40) + "…";
        return "the string \"" + text + "\"";
    }
    case Token::Open:
        return "[";
    case Token::Close:
        return "]";
    case Token::Floats:
        return "a binary array";
    case Token::Bad: {
        const auto c = static_cast<unsigned char>(m_lexer->bad_character());
        if (c >= 0200)
            return "a byte of value " + std::to_string(int(c)) + ", which no encoding of RIB has here";
        return std::isprint(c) ? std::string("the character ") + char(c)
                               : "a character of value " + std::to_string(int(c));
    }
    }
    return "nothing";
}

// ---- archives ---------------------------------------------------------------------------------------

void Reader::read_archive(const std::string& name, const Location& where) {
    read_archive_file(name, where);
}

bool Reader::read_archive_file(const std::string& given_name, const Location& given_where) {
    const std::string name = given_name; // both are overwritten by the archive's own requests
    const Location where = given_where;
    const auto guarded = [&](const std::string& id, auto&& read) {
        if (std::find(m_open_archives.begin(), m_open_archives.end(), id) != m_open_archives.end() ||
            m_open_archives.size() >= MaxArchiveDepth) {
            std::string chain;
            for (size_t i = 0; i < m_open_archives.size(); i++)
                if (i < 4 || i + 2 >= m_open_archives.size())
                    chain += m_open_archives[i] + " > ";
            m_context.reports.error("archive in itself", where,
                                    "ReadArchive \"" + name + "\" was left out: the archive reads itself (" +
                                        chain + id + ")");
            return false;
        }
        if (m_open_archives.size() >= DeepArchive && ++m_deep_reads > MaxDeepReads) {
            m_context.reports.once(Severity::Error, "archives without end", where,
                                   "ReadArchive was left out: archives have read others, " +
                                       std::to_string(DeepArchive) + " deep or more, " +
                                       std::to_string(MaxDeepReads) +
                                       " times; look for archives that double");
            return false;
        }
        m_open_archives.push_back(id);
        const bool done = read();
        m_open_archives.pop_back();
        return done;
    };
    // Step 1: archives within the file go before files.
    if (const auto known = m_inline_archives.find(name); known != m_inline_archives.end()) {
        const InlineArchive archive = known->second;
        return guarded(name, [&] {
            Lexer lexer(archive.source, archive.begin, archive.end, archive.definitions);
            run(lexer);
            return true;
        });
    }
    // Step 2: the folder of the file that asks, then the caller's folders, then Option "searchpath"
    // "archive".
    std::vector<std::string> folders{folder()};
    folders.insert(folders.end(), m_extra_path.begin(), m_extra_path.end());
    const auto& option = m_context.options.options.archive_path;
    folders.insert(folders.end(), option.begin(), option.end());
    const auto path = find_file(name, folders);
    if (!path) {
        std::string looked;
        for (const std::string& folder : folders) {
            const std::string shown = folder.empty() ? "." : folder;
            if (looked.find("\"" + shown + "\"") == std::string::npos)
                looked += (looked.empty() ? "\"" : ", \"") + shown + "\"";
        }
        m_context.reports.error("missing archive", where,
                                "ReadArchive \"" + name + "\" was left out: the file is not in " + looked +
                                    "; set Option \"searchpath\" \"archive\"");
        return false;
    }
    std::error_code ignored;
    const std::string real = std::filesystem::weakly_canonical(*path, ignored).string();
    return guarded(real.empty() ? *path : real, [&] {
        std::shared_ptr<const Source> source;
        try {
            source = Source::open(*path);
        } catch (const Error& e) {
            m_context.reports.error("missing archive", where,
                                    "ReadArchive \"" + name + "\" was left out: " + std::string(e.what()));
            return false;
        }
        run(source);
        return true;
    });
}

// What is made on the way has no identity that could be met again: only its depth is bounded.
void Reader::read_text(std::string text, const std::string& given_name, const Location& given_where) {
    const std::string name = given_name;
    const Location where = given_where;
    if (m_open_archives.size() >= MaxArchiveDepth) {
        m_context.reports.error("archive in itself", where,
                                name + " was left out: procedurals and archives nest " +
                                    std::to_string(MaxArchiveDepth) + " deep at most");
        return;
    }
    m_open_archives.push_back(name);
    run(Source::from_text(std::move(text), name));
    m_open_archives.pop_back();
}

void Reader::record_archive(const std::string& name) {
    if (!m_lexer) { // a program's
        m_recording = std::make_unique<Recording>();
        m_recording->name = name;
        m_recording->output = output_to(m_recording->text);
        m_recording->writer = std::make_unique<Writer>(*m_recording->output, Writer::Form::Ascii);
        return;
    }
    const std::string key = name;
    const size_t begin = m_lexer->position();
    skip_to("ArchiveBegin", {"ArchiveEnd"});
    m_lexer->peek();
    m_inline_archives[key] = {m_lexer->source(), begin, m_lexer->offset(), m_lexer->definitions()};
    if (m_lexer->peek() == Token::End)
        m_context.reports.error("file ends early", m_call.where,
                                "ArchiveBegin \"" + key + "\" is not closed; add ArchiveEnd");
    else
        m_lexer->skip();
}

void Reader::skip_to(std::string_view begin, std::initializer_list<std::string_view> stops) {
    if (!m_lexer) {
        m_passing = std::make_unique<Passing>();
        m_passing->begin = begin;
        m_passing->stops.assign(stops.begin(), stops.end());
        return;
    }
    const bool declarations_count = begin == "FrameBegin" || begin == "WorldBegin";
    for (int depth = 0;;) {
        const Token token = m_lexer->peek();
        if (token == Token::End)
            return; // whoever opened the block reports that nothing closes it
        if (token != Token::Word) {
            m_lexer->skip();
            continue;
        }
        const size_t offset = m_lexer->offset();
        const std::string_view word = m_lexer->word();
        if (word == begin) {
            depth++;
        } else if (depth > 0) {
            depth -= word == *(stops.end() - 1);
        } else if (std::find(stops.begin(), stops.end(), word) != stops.end()) {
            m_lexer->seek(offset);
            return;
        }
        if (declarations_count && word == "Declare") {
            Call call;
            call.spec = find_request(word);
            call.where = m_lexer->where(offset);
            m_request = word;
            if (read_arguments(call))
                handlers::declare(m_context, call);
        }
    }
}

} // namespace kanuka::ingest
