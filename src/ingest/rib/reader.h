// The RIB parser: tokens to calls by the table of requests, archives, and recovery from what it cannot read.
#pragma once

#include <map>
#include <memory>
#include <utility>

#include "base/large_pages.h"
#include "ingest/rib/context.h"
#include "ingest/rib/lexer.h"
#include "ingest/rib/writer.h"

namespace kanuka::ingest {

// Who takes calls instead of the context: nothing is executed then but what reading itself needs.
class CallSink {
  public:
    virtual ~CallSink() = default;
    virtual void call(Call& call) = 0;
    virtual void unknown(std::string_view request, Lexer& lexer) = 0; // its tokens follow
    virtual void comment(std::string_view text) = 0;
};

// Thread safety: none; one reader a scene.
class Reader final : public Stream {
  public:
    Reader(Journal& journal, FrameChoice frame, const RibOptions& options, const Source& scene);

    void run(const std::shared_ptr<const Source>& source);
    Context& context() { return m_context; }
    // A call that a program makes; `m_lexer` is null then. (reader_calls.cpp)
    void call(Call& call);
    // A line of text as it is, for the archive that a program records; false = it records none.
    bool record_line(const std::string& text);
    bool record_text(const std::string& text); // that need be no line
    // From here on calls go to a sink as they were written: parameters neither checked nor declared away.
    void pass_on(CallSink& sink) { m_sink = &sink; }
    // Who hears, in order, what files hold beside requests: "comment", "structure", "verbatim", and its text.
    // What the table of requests does not know is verbatim then, and not reported. Returns who heard before.
    using RecordListener = std::function<void(const char* type, const std::string& text)>;
    RecordListener listen(RecordListener listener) { return std::exchange(m_listener, std::move(listener)); }
    // Does what a file asked for as if its reading stood there: archives are looked for beside it.
    void resume(const std::string& file, const std::function<void()>& work);
    // False: reported, nothing was read.
    bool read_archive_file(const std::string& name, const Location& where);

    void read_archive(const std::string& name, const Location& where) override;
    void read_text(std::string text, const std::string& name, const Location& where) override;
    void skip_to(std::string_view begin, std::initializer_list<std::string_view> stops) override;
    void record_archive(const std::string& name) override;
    void stop() override { m_stopped = true; }
    std::string folder() const override;
    double progress() const override;

    static constexpr size_t MaxArchiveDepth = 100;
    // Archives that read two others each, and so on, would never end: so many reads may lie this deep.
    static constexpr size_t DeepArchive = 5;
    static constexpr int MaxDeepReads = 1'000'000;

  private:
    struct InlineArchive {
        std::shared_ptr<const Source> source;
        size_t begin, end;
        std::shared_ptr<BinaryDefinitions> definitions;
    };
    void run(Lexer& lexer);
    void request();
    void pass_comments(size_t before);
    void tell(const char* type, const std::string& text);
    void tell_unknown(size_t begin);
    void unknown_request(std::string_view word);
    void resynchronise();

    // reader_arguments.cpp. False: reported, and the request is to be left out.
    bool read_arguments(Call& call);
    bool read_argument(const ArgSpec& spec, Argument& argument, bool& in_brackets);
    // `what` is the argument's or parameter's name, for messages.
    bool read_numbers(std::vector<float>& out, std::string_view what);
    bool read_integers(std::vector<int32_t>& out, std::string_view what);
    bool read_strings(std::vector<std::string>& out, std::string_view what);
    bool read_string(std::string& out);
    bool wrong(const char* expected, std::string_view what);
    // After the elements of an array: true at ']', which is consumed; else says what stands there instead.
    bool close_array(size_t open, std::string_view what, const char* elements);
    template <class T>
    scene::Buffer<T> kept(const std::vector<T>& values);
    std::string found();

    // reader_parameters.cpp
    bool read_parameters(Call& call);
    bool read_parameter(Call& call);
    bool read_parameter(Call& call, scene::Value& value); // into m_take_value whether it is to be kept
    bool read_value(Call& call, scene::Value& value, const Declaration& declaration);
    bool read_as_written(Call& call);
    Token kind_of_value();
    // ColorSamples in force: a colour's numbers become RGB. False: reported, they are not colours.
    bool colors_of_samples(const Call& call, const scene::Value& value, std::vector<float>& numbers);
    bool read_undeclared(Call& call, scene::Value& value);
    bool fit_value(const Call& call, scene::Value& value, size_t found);

    Declarations m_declarations;
    const std::vector<std::string> m_extra_path;
    Context m_context;
    Lexer* m_lexer = nullptr;
    Call m_call;
    std::string m_request; // name of the request being read, for messages
    std::string m_token;
    // Small arrays of many primitives share a block: one allocation for thousands of them.
    struct Block {
        explicit Block(size_t size) : bytes(LargePages<std::byte>().allocate(size)), size(size) {}
        ~Block() { LargePages<std::byte>().deallocate(bytes, size); }
        Block(const Block&) = delete;
        std::byte* bytes;
        size_t size, used = 0;
    };
    std::shared_ptr<Block> m_block;
    bool m_take_value = false;      // the parameter being read, which lies in the call already
    size_t m_parameters_before = 0; // of the call before: most have as many
    const Lexer* m_outermost_lexer = nullptr;
    std::vector<float> m_floats; // scratch
    std::vector<int32_t> m_ints;
    std::vector<std::string> m_strings;
    std::map<std::string, InlineArchive> m_inline_archives;
    std::vector<std::string> m_open_archives; // names, outermost first
    int m_deep_reads = 0;
    bool m_stopped = false;
    // Of calls from programs: what skip_to() passes over, and the archive being recorded, as RIB.
    struct Passing {
        std::string begin;
        std::vector<std::string> stops;
        int depth = 0;
    };
    struct Recording {
        std::string name, text;
        std::unique_ptr<Output> output;
        std::unique_ptr<Writer> writer;
        int depth = 0;
    };
    bool passes_over(const Call& call);
    bool records(const Call& call);
    std::unique_ptr<Passing> m_passing;
    std::unique_ptr<Recording> m_recording;
    CallSink* m_sink = nullptr;
    RecordListener m_listener;
    std::vector<Lexer::Comment> m_comments; // for the sink or the listener
};

} // namespace kanuka::ingest
