// One RiBegin … RiEnd: renders its worlds, or writes its calls as RIB.
#pragma once

#include <deque>
#include <memory>
#include <string>

#include "ingest/rib/reader.h"
#include "ri.h"

namespace kanuka::ri {

// Thread safety: none; a program makes its calls one after another.
class Session {
  public:
    // Empty: renders. NAME.rib, .rib.gz, .rib.zst: writes. Throws Error where that cannot be.
    explicit Session(const std::string& name);

    // Writes into `text`, as what stands in a world: what a plug-in's calls become (plug_in.h).
    struct Recording {
        std::string text, problems;
    };
    explicit Session(Recording& recording);

    void execute(ingest::Call& call);
    void comment(const std::string& text); // a line as it is, where calls become RIB
    // While it lives, a function of the program is told what archives hold beside requests; null = none.
    class Listening {
      public:
        Listening(Session* session, RtArchiveCallback callback);
        ~Listening();
        Listening(const Listening&) = delete;

      private:
        ingest::Reader* m_reader = nullptr;
        ingest::Reader::RecordListener m_before;
    };
    void finish(); // RiEnd

    bool writes() const { return m_writer != nullptr; }
    ingest::Context& context() { return m_reader->context(); }
    Location where() const { return {"(program)", 0, 0}; }
    RtPointer keep_handle(const std::string& text);
    const char* keep_token(const std::string& text) { return m_kept.emplace_back(text).c_str(); }
    // Of a name in C: a handle that keep_handle() made, else null.
    const std::string* handle(RtPointer pointer) const;

    void report(RtInt code, RtInt severity, const std::string& message);
    RtErrorFunc error_handler = RiErrorPrint;
    int next_handle = 1;
    int procedural_depth = 0;

  private:
    void render_world();
    void make_left_textures();
    Recording* m_recording = nullptr;
    Journal m_journal;
    std::shared_ptr<const ingest::Source> m_source; // of no bytes: calls have no file
    std::unique_ptr<ingest::Reader> m_reader;
    std::unique_ptr<ingest::Output> m_output;
    std::unique_ptr<ingest::Writer> m_writer;
    std::deque<std::string> m_kept; // what C holds pointers to
    int m_pictures = 0;
    bool m_textures_left = false; // asked for, and no world has been rendered since
};

// The session of RiBegin or RiContext; null = none.
Session* current();
// While it lives calls go to another session.
class Redirect {
  public:
    explicit Redirect(Session& session);
    ~Redirect();
    Redirect(const Redirect&) = delete;

  private:
    Session* m_before;
};

// How many values the primitive of a call has of each storage class, by its arguments.
struct Lengths {
    long uniform = 1, varying = 1, vertex = 1, face_varying = 1;
    long of(scene::Detail detail) const;
};
Lengths lengths_of(const ingest::Call& call, long vertices, int ustep, int vstep);

} // namespace kanuka::ri
