// Programs that make RIB (RISpec 5.9, RunProgram): started once, asked by a line on their standard input, and
// each answer read up to the byte \377.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace kanuka::ingest {

// Thread safety: none.
class Programs {
  public:
    Programs();
    ~Programs(); // ends them
    Programs(const Programs&) = delete;

    struct Limits {
        double seconds = 300;           // without a byte
        size_t bytes = size_t(1) << 32; // of one answer
    };
    // Throws Error. `command`: a file and its arguments, parted by blanks; the file is looked for in
    // `folders`, then where the system looks. "sh" and the like are not asked.
    std::string ask(const std::string& command, const std::vector<std::string>& folders,
                    const std::string& line, const Limits& limits);
    std::string ask(const std::string& command, const std::vector<std::string>& folders,
                    const std::string& line) {
        return ask(command, folders, line, Limits());
    }

  private:
    struct Program;
    std::map<std::string, std::unique_ptr<Program>> m_running; // by command
};

} // namespace kanuka::ingest
