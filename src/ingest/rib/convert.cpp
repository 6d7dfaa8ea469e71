#include "ingest/rib/convert.h"

#include "ingest/rib/handlers.h"
#include "ingest/rib/reader.h"
#include "ingest/rib/writer.h"

namespace kanuka::ingest {

namespace {

class Converter final : public CallSink {
  public:
    Converter(Reader& reader, Writer& writer, bool expand)
        : m_reader(reader), m_writer(writer), m_expand(expand) {}

    void call(Call& call) override {
        const std::string_view name = call.spec->name;
        if (name == "Declare") { // tells integers from floats
            handlers::declare(m_reader.context(), call);
        } else if (m_expand) {
            if (name == "ReadArchive" && !m_inline.contains(call.text(0))) {
                const std::string archive = call.text(0); // `call` is used by the archive's own
                if (m_reader.read_archive_file(archive, call.where))
                    return;
            } else if (name == "Procedural" && call.text(0) == "DelayedReadArchive" &&
                       !call.args[1].strings.empty()) {
                expand_procedural(call);
                return;
            } else if (name == "ArchiveBegin") {
                m_inline.insert(call.text(0));
            } else if (name == "Option" && call.text(0) == "searchpath") {
                Call copy = call;
                handlers::option(m_reader.context(), copy);
            }
        }
        m_writer.call(call);
    }

    void unknown(std::string_view request, Lexer& lexer) override {
        m_writer.request(request);
        for (;;) {
            const Token token = lexer.peek();
            if (token == Token::Number) {
                m_writer.number(lexer.number());
            } else if (token == Token::String) {
                const std::string text(lexer.string());
                m_writer.string(text);
            } else if (token == Token::Floats) {
                std::vector<float> floats;
                lexer.binary_floats(floats);
                for (const float f : floats)
                    m_writer.number(double(f));
            } else if (token == Token::Open || token == Token::Close) {
                lexer.skip();
                token == Token::Open ? m_writer.open() : m_writer.close();
            } else {
                break;
            }
        }
        m_writer.end_request();
    }

    void comment(std::string_view text) override { m_writer.comment(text); }

  private:
    void block(const char* name) {
        Call call;
        call.spec = find_request(name);
        m_writer.call(call);
    }
    void expand_procedural(Call& call) {
        const Call kept = call;
        block("AttributeBegin");
        if (!m_reader.read_archive_file(kept.args[1].strings[0], kept.where))
            m_writer.call(kept);
        block("AttributeEnd");
    }

    Reader& m_reader;
    Writer& m_writer;
    const bool m_expand;
    std::set<std::string> m_inline;
};

void convert(const std::shared_ptr<const Source>& source, Output& output, const ConvertOptions& options,
             Journal& journal) {
    RibOptions rib;
    rib.archive_path = options.archive_path;
    Reader reader(journal, {}, rib, *source);
    Writer writer(output, options.binary ? Writer::Form::Binary : Writer::Form::Ascii);
    Converter converter(reader, writer, options.expand_archives);
    reader.pass_on(converter);
    reader.run(source);
    writer.flush();
}

} // namespace

void convert_rib(const std::string& from, const std::string& to, const ConvertOptions& options,
                 Journal& journal) {
    const std::shared_ptr<const Source> source = Source::open(from);
    const std::unique_ptr<Output> output = open_output(to, options.packing);
    convert(source, *output, options, journal);
    output->finish();
}

std::string convert_text(const std::string& text, const std::string& name, const ConvertOptions& options,
                         Journal& journal) {
    std::string result;
    const std::unique_ptr<Output> output = output_to(result);
    convert(Source::from_text(text, name), *output, options, journal);
    return result;
}

} // namespace kanuka::ingest
