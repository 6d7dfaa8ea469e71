#include "sl/slo.h"

#include <unordered_map>

#include <zlib.h>

#include "sl/bytes.h"
#include "sl/codegen/cache.h"
#include "sl/sl.h"

namespace kanuka::sl {

namespace {

constexpr std::string_view Magic = "KNKSLO\n1\n", MagicHead = "KNKSLO\n";
// Nothing that a shader writer makes is larger; a damaged size must not take the machine's memory.
constexpr uint64_t MaxBytes = uint64_t(1) << 31;

struct Header {
    struct Part {
        uint64_t compressed, bytes;
    } metadata, tokens;
    uint64_t hash, checksum; // checksum of all that follows, and of the sizes and hash
};

uint64_t checksum(Header h, std::string_view rest) {
    h.checksum = 0;
    return hash_bytes(rest.data(), rest.size(), hash_bytes(&h, sizeof h));
}

// ---- metadata

std::string json_text(std::string_view s) {
    std::string out = "\"";
    for (const char c : s) {
        if (c == '"' || c == '\\') {
            out += '\\';
            out += c;
        } else if (static_cast<unsigned char>(c) < 32) {
            char code[8];
            std::snprintf(code, sizeof code, "\\u%04x", c);
            out += code;
        } else {
            out += c;
        }
    }
    return out + "\"";
}

std::string number(float x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", double(x));
    const std::string s = text;
    return s.find_first_of("in") == std::string::npos ? s : "null"; // JSON has no infinities
}

std::string default_value(const Parameter& p) {
    std::string out;
    for (const std::string& s : p.strings)
        out += (out.empty() ? "" : ", ") + json_text(s);
    for (const float x : p.floats)
        out += (out.empty() ? "" : ", ") + number(x);
    if (out.empty())
        return "null";
    return p.strings.size() + p.floats.size() == 1 && !p.array_size ? out : "[" + out + "]";
}

std::string metadata(const Sources& sources, const Preprocessed& source, const ir::Program& program) {
    std::string s = "{\n \"name\": " + json_text(program.name) + ",\n \"kind\": \"" +
                    std::string(kind_name(program.kind)) +
                    "\",\n \"compiler\": " + std::to_string(CompilerVersion) + ",\n \"parameters\": [";
    const char* separator = "\n";
    for (const Parameter& p :
         std::span(program.parameters).first(program.parameters.size() - size_t(program.carried))) {
        s += std::string(separator) + "  {\"name\": " + json_text(p.name) + ", \"type\": \"" +
             std::string(type_name(p.type)) + "\", \"array_size\": " + std::to_string(p.array_size) +
             ", \"varying\": " + (p.varying ? "true" : "false") +
             ", \"output\": " + (p.output ? "true" : "false") + ", \"default\": " + default_value(p) +
             ", \"doc\": " + json_text(p.doc) + "}";
        separator = ",\n";
    }
    s += "],\n \"annotations\": [";
    separator = "\n";
    for (const Pragma& p : source.pragmas) {
        if (p.tokens.size() < 2 || !p.tokens[0].is("annotation"))
            continue;
        s += std::string(separator) + "  [" + json_text(p.tokens[1].text) + ", " +
             json_text(p.tokens.size() > 2 ? p.tokens[2].text : "") + "]";
        separator = ",\n";
    }
    s += "],\n \"textures\": [";
    separator = "\n";
    for (const TextureUse& t : program.textures) {
        s += std::string(separator) + "  {\"file\": " + json_text(t.file) +
             ", \"parameter\": " + json_text(t.parameter) +
             ", \"environment\": " + (t.environment ? "true" : "false") + "}";
        separator = ",\n";
    }
    s += "],\n \"files\": [";
    separator = "";
    for (uint32_t f = 0; f < sources.count(); f++)
        if (!sources.name(f).starts_with('<')) {
            s += separator + json_text(sources.name(f));
            separator = ", ";
        }
    return s + "]\n}\n";
}

// ---- tokens

// Texts by number: names and operators come up again and again.
class Texts {
  public:
    uint64_t add(std::string_view s) {
        const auto [it, fresh] = m_numbers.try_emplace(s, m_list.size());
        if (fresh)
            m_list.push_back(s);
        return it->second;
    }
    void write(ByteWriter& out) const {
        out.count(m_list.size());
        for (const std::string_view s : m_list)
            out.text(s);
    }

  private:
    std::unordered_map<std::string_view, uint64_t> m_numbers;
    std::vector<std::string_view> m_list;
};

void put_tokens(ByteWriter& out, Texts& texts, const std::vector<Token>& tokens) {
    out.count(tokens.size());
    Loc last;
    for (const Token& t : tokens) {
        const bool line = t.loc.line != last.line || t.loc.file != last.file;
        const bool whole = t.kind == Token::Number && t.number >= 0 && t.number < 1e6f &&
                           t.number == float(uint32_t(t.number));
        out.put(uint8_t(t.kind | line << 3 | t.space_before << 4 | t.line_start << 5 | whole << 6));
        out.count(texts.add(t.text));
        if (t.kind == Token::Number) {
            if (whole)
                out.count(uint64_t(t.number));
            else
                out.put(t.number);
        }
        if (line) {
            out.count(t.loc.file);
            out.count(t.loc.line);
        }
        out.count(t.loc.column);
        last = t.loc;
    }
}

std::vector<Token> get_tokens(ByteReader& in, const std::vector<std::string_view>& texts, uint32_t files) {
    std::vector<Token> tokens(in.length(3));
    Loc last;
    for (Token& t : tokens) {
        const uint8_t flags = in.get<uint8_t>();
        const uint64_t text = in.count();
        if ((flags & 7) > Token::Punctuation || text >= texts.size()) {
            in.fail();
            return {};
        }
        t.kind = Token::Kind(flags & 7);
        t.text = texts[text];
        t.space_before = flags & 16;
        t.line_start = flags & 32;
        if (t.kind == Token::Number)
            t.number = flags & 64 ? float(in.count()) : in.get<float>();
        if (flags & 8) {
            last.file = uint32_t(in.count());
            last.line = uint32_t(in.count());
        }
        last.column = uint32_t(in.count());
        t.loc = last;
        if (last.file >= files)
            in.fail();
    }
    return tokens;
}

std::string deflated(const std::string& bytes) {
    uLongf size = compressBound(uLong(bytes.size()));
    std::string out(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                  uLong(bytes.size()), 9) != Z_OK)
        throw Error("a shader cannot be compressed", ExitCode::Internal);
    out.resize(size);
    return out;
}

bool inflate_to(std::string& out, std::string_view compressed, uint64_t bytes) {
    if (bytes > MaxBytes || bytes / 1100 > compressed.size()) // zlib packs no tighter than 1 : 1032
        return false;
    out.resize(bytes);
    uLongf size = uLongf(bytes);
    return uncompress(reinterpret_cast<Bytef*>(out.data()), &size,
                      reinterpret_cast<const Bytef*>(compressed.data()), uLong(compressed.size())) == Z_OK &&
           size == bytes;
}

} // namespace

bool is_slo(std::string_view bytes) {
    return bytes.starts_with(MagicHead);
}

std::string write_slo(const Sources& sources, const Preprocessed& source, const ir::Program& program) {
    ByteWriter body;
    Texts texts;
    put_tokens(body, texts, source.tokens);
    body.count(source.pragmas.size());
    for (const Pragma& p : source.pragmas) {
        body.count(p.loc.file);
        body.count(p.loc.line);
        body.count(p.loc.column);
        put_tokens(body, texts, p.tokens);
    }
    ByteWriter all;
    all.count(sources.count());
    for (uint32_t f = 0; f < sources.count(); f++) {
        all.text(sources.name(f));
        all.text(sources.text(f));
        const auto& comments = sources.comments(f);
        all.count(comments.size());
        for (const auto& [line, text] : comments) {
            all.count(line);
            all.count(uint64_t(text.data() - sources.text(f).data()));
            all.count(text.size());
        }
    }
    texts.write(all);
    const std::string tokens = all.take() + body.take();
    const std::string about = metadata(sources, source, program);
    const std::string parts[] = {deflated(about), deflated(tokens)};
    Header h{{parts[0].size(), about.size()}, {parts[1].size(), tokens.size()}, source.hash, 0};
    const std::string rest = parts[0] + parts[1];
    h.checksum = checksum(h, rest);
    return std::string(Magic) + std::string(reinterpret_cast<const char*>(&h), sizeof h) + rest;
}

std::optional<Published> read_slo(std::string_view bytes, std::string& problem, bool metadata_alone) {
    const auto damaged = [&problem](const std::string& how) {
        problem = "the published shader is damaged: " + how + "; publish it again";
        return std::nullopt;
    };
    if (!bytes.starts_with(Magic)) {
        if (!is_slo(bytes) || MagicHead.size() == bytes.size())
            return damaged("it does not begin as one");
        problem = "the published shader is of another version than this program reads; publish it again with "
                  "\"kanuka shader publish\"";
        return std::nullopt;
    }
    bytes.remove_prefix(Magic.size());
    Header h;
    if (bytes.size() < sizeof h)
        return damaged("it ends early");
    std::memcpy(&h, bytes.data(), sizeof h);
    bytes.remove_prefix(sizeof h);
    const uint64_t first = h.metadata.compressed, second = h.tokens.compressed;
    if (first > bytes.size() || second > bytes.size() - first)
        return damaged("it ends early");
    if (first + second != bytes.size())
        return damaged("something follows its end");
    if (h.checksum != checksum(h, bytes))
        return damaged("its checksum does not fit");
    Published p;
    p.hash = h.hash;
    if (!inflate_to(p.metadata, bytes.substr(0, first), h.metadata.bytes) ||
        (!metadata_alone && !inflate_to(p.tokens, bytes.substr(first), h.tokens.bytes)))
        return damaged("it cannot be decompressed");
    return p;
}

Preprocessed unpack(const Published& published, Sources& sources, std::string& problem) {
    Preprocessed out;
    out.hash = published.hash;
    const uint32_t first = sources.count(); // other sources may be there before
    ByteReader in(published.tokens);
    const size_t files = in.length(2);
    for (size_t f = 0; f < files && in.ok(); f++) {
        std::string name(in.text()), text(in.text());
        const uint32_t file = sources.add(std::move(name), std::move(text));
        const std::string_view kept = sources.text(file);
        for (size_t n = in.length(3); n > 0 && in.ok(); n--) {
            const uint64_t line = in.count(), begin = in.count(), size = in.count();
            if (begin > kept.size() || size > kept.size() - begin)
                in.fail();
            else
                sources.note_comment(file, uint32_t(line), kept.substr(begin, size));
        }
    }
    std::vector<std::string_view> texts(in.length());
    for (std::string_view& s : texts)
        s = sources.keep(std::string(in.text()));
    out.tokens = get_tokens(in, texts, uint32_t(files));
    out.pragmas.resize(in.length(4));
    for (Pragma& p : out.pragmas) {
        p.loc.file = uint32_t(in.count());
        p.loc.line = uint32_t(in.count());
        p.loc.column = uint32_t(in.count());
        p.tokens = get_tokens(in, texts, uint32_t(files));
    }
    for (Token& t : out.tokens)
        t.loc.file += first;
    for (Pragma& p : out.pragmas) {
        p.loc.file += first;
        for (Token& t : p.tokens)
            t.loc.file += first;
    }
    if (!in.ok() || !in.at_end() || out.tokens.empty() || out.tokens.back().kind != Token::End)
        problem = "the published shader is damaged: its tokens cannot be read; publish it again";
    return out;
}

} // namespace kanuka::sl
