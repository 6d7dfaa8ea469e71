// One RiBegin … RiEnd: renders its worlds, or writes its calls as RIB.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "ingest/rib/reader.h"
#include "ri.h"

namespace kanuka::ri {

// Thread safety: none; a program makes its calls one after another.
class Session {
  public:
    // What RiOption "rib" asks of the next file; unset = as its name has it.
    struct Form {
        std::optional<ingest::Packing> packing;
        bool binary = false;
    };
    // Empty: renders. NAME.rib, .rib.gz, .rib.zst: writes; "|command": to a program. Throws Error where that
    // cannot be.
    Session(const std::string& name, const Form& form);

    // Writes into `text`, as what stands in a world: what a plug-in's calls become (plug_in.h).
    struct Recording {
        std::string text, problems;
    };
    explicit Session(Recording& recording);

    void execute(ingest::Call& call);
    // Where calls become RIB: a line as it is, or text that need be no line.
    void comment(const std::string& text);
    void verbatim(const std::string& text);
    // While it lives, a function of the program is told what archives hold beside requests; null = none.
    class Listening {
      public:
        Listening(std::shared_ptr<Session> session, RtArchiveCallback callback);
        ~Listening();
        Listening(const Listening&) = delete;

      private:
        std::shared_ptr<Session> m_session;
        ingest::Reader::RecordListener m_before;
    };
    void finish(); // RiEnd; what callbacks that are under way call after it is left out
    // At the end of a program that did not call RiEnd: a file holds what was written.
    void abandon();

    // What a name of RiBegin that says nothing is taken for.
    void say_what_it_does();

    bool ended() const { return m_ended; }
    bool records() const { return m_recording != nullptr; } // for a plug-in
    bool writes() const { return m_writer != nullptr; }
    ingest::Context& context() { return m_reader->context(); }
    Location where() const { return {"(program)", 0, 0}; }
    RtPointer keep_handle(const std::string& text);
    // Of a name in C: a handle that keep_handle() made, else null.
    const std::string* handle(RtPointer pointer) const;

    // To the handler; what is wrong with its own calls is printed.
    void report(RtInt code, RtInt severity, const std::string& message);
    // What the scene's journal says while it is locked, and other threads wait, is no time for a program's
    // function to run: it hears of it when the call is done.
    void hear(RtInt code, RtInt severity, std::string message);
    RtErrorFunc error_handler = RiErrorPrint;
    int next_handle = 1;
    int procedural_depth = 0;

  private:
    void render_world();
    void make_left_textures();
    void run(ingest::Call& call);
    bool handling() const; // the program's error handler runs
    void tell_heard();
    struct Heard {
        RtInt code, severity;
        std::string message;
    };
    Recording* m_recording = nullptr;
    std::string m_name, m_command; // of RiBegin; the program that reads the RIB, empty = a file
    Journal m_journal;
    std::shared_ptr<const ingest::Source> m_source; // of no bytes: calls have no file
    std::unique_ptr<ingest::Reader> m_reader;
    std::unique_ptr<ingest::Output> m_output;
    std::unique_ptr<ingest::Writer> m_writer;
    std::deque<std::string> m_kept; // what C holds pointers to
    std::deque<Heard> m_heard;
    const void* m_handling = nullptr; // the stack where the handler was called; null = it is not running
    bool m_ended = false;
    int m_pictures = 0;
    bool m_textures_left = false; // asked for, and no world has been rendered since
};

// How many values the primitive of a call has of each storage class, by its arguments.
struct Lengths {
    long uniform = 1, varying = 1, vertex = 1, face_varying = 1;
    long of(scene::Detail detail) const;
};
Lengths lengths_of(const ingest::Call& call, long vertices, int ustep, int vstep);

} // namespace kanuka::ri
