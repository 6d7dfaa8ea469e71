// Writes calls as RIB, ASCII or binary, by the table of requests: what the parser reads back bit by bit.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>

#include "ingest/rib/output.h"
#include "ingest/rib/requests.h"

namespace kanuka::ingest {

// The canonical form: a request a line, arrays and values in brackets, numbers as short as they stay the same
// (as a float, or an integer), strings in quotes. Long arrays go on in the next line.
// Thread safety: none.
class Writer {
  public:
    enum class Form : uint8_t { Ascii, Binary };
    Writer(Output& output, Form form) : m_output(output), m_form(form) {}
    ~Writer() = default;
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;

    void call(const Call& call);
    void comment(std::string_view text); // from its '#' on; a line of its own
    // RIB as it is. More of it goes on where it ends; anything else begins a line.
    void verbatim(std::string_view text);
    void flush(); // to the output

    // The tokens, for requests that the table does not know.
    void request(std::string_view name);
    void number(double value);
    void string(std::string_view text);
    void open();
    void close();
    void end_request();

  private:
    void argument(const ArgSpec& spec, const Argument& argument);
    void parameter(std::string_view token, const scene::Value& value);
    void numbers(const float* values, size_t count, bool brackets);
    void token(std::string_view token); // a string that is likely to come again
    void separate(size_t length);       // a blank or a line break before what comes
    void big_endian(uint64_t value, int bytes);
    void string_bytes(std::string_view text);
    void settle(); // after verbatim text
    void end_line();
    bool binary() const { return m_form == Form::Binary; }

    Output& m_output;
    const Form m_form;
    std::string m_buffer;
    bool m_loose = false;                                 // it ends in verbatim text, within a line
    size_t m_line = 0;                                    // where the current one starts in the buffer
    std::unordered_map<std::string_view, int> m_requests; // names in the table
    std::unordered_map<std::string, uint32_t> m_tokens;
};

} // namespace kanuka::ingest
