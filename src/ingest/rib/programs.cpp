#include "ingest/rib/programs.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <poll.h>
#include <spawn.h>
#include <sstream>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/error.h"
#include "ingest/rib/search_path.h"

extern char** environ;

namespace kanuka::ingest {

struct Programs::Program {
    pid_t pid = -1;
    int to = -1, from = -1;
    std::string rest; // that came after the last answer

    ~Program() {
        if (to >= 0)
            close(to);
        if (from >= 0)
            close(from);
        if (pid <= 0)
            return;
        // The end of its input asks it to go; what does not is made to.
        for (int i = 0; i < 50; i++) {
            if (waitpid(pid, nullptr, WNOHANG) != 0)
                return;
            usleep(2000);
        }
        kill(pid, SIGKILL);
        waitpid(pid, nullptr, 0);
    }
};

Programs::Programs() = default;
Programs::~Programs() = default;

namespace {

// Words parted by blanks; quotes hold them together.
std::vector<std::string> words_of(const std::string& command) {
    std::vector<std::string> words;
    std::string word;
    char quote = 0;
    bool any = false;
    for (const char c : command) {
        if (quote) {
            if (c == quote)
                quote = 0;
            else
                word += c;
        } else if (c == '"' || c == '\'') {
            quote = c;
            any = true;
        } else if (c == ' ' || c == '\t' || c == '\n') {
            if (any || !word.empty())
                words.push_back(word);
            word.clear();
            any = false;
        } else {
            word += c;
        }
    }
    if (any || !word.empty())
        words.push_back(word);
    return words;
}

} // namespace

// What a script's first line names: "#!/usr/bin/env python" is python's. Empty = it is no script that can be
// read.
static std::string interpreter_of(const std::string& file) {
    std::ifstream in(file);
    std::string line;
    if (!std::getline(in, line) || !line.starts_with("#!"))
        return {};
    std::istringstream words(line.substr(2));
    std::string name, next;
    words >> name;
    if (name.ends_with("/env") && words >> next)
        name = next;
    return name;
}

// Scripts of thirty years name interpreters that machines of today have elsewhere, or in a later version.
static std::string usual_interpreter(const std::string& named) {
    const std::string base = named.substr(named.rfind('/') + 1);
    for (const std::string_view known :
         {"python", "perl", "ruby", "tclsh", "bash", "zsh", "ksh", "csh", "sh"})
        if (base.starts_with(known))
            return known == "python" ? "python3" : std::string(known);
    return {};
}

static void start(const std::string& command, const std::vector<std::string>& folders, pid_t& pid, int& to,
                  int& from) {
    std::vector<std::string> words = words_of(command);
    if (words.empty())
        throw Error("it has no name");
    if (const auto path = find_file(words[0], folders))
        words[0] = path->find('/') == std::string::npos ? "./" + *path : *path;
    for (size_t i = 1; i < words.size(); i++) // of an interpreter: where its script is
        if (const auto script = find_file(words[i], folders)) {
            words[i] = *script;
            break;
        }
    std::vector<char*> argv;
    for (std::string& w : words)
        argv.push_back(w.data());
    argv.push_back(nullptr);
    int in[2], out[2]; // a socket towards it: writing to one that is gone is an error, no signal
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, in) != 0)
        throw Error(std::strerror(errno));
    if (pipe2(out, O_CLOEXEC) != 0) {
        close(in[0]), close(in[1]);
        throw Error(std::strerror(errno));
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[1], 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    int failure = posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ);
    std::string interpreter, named;
    if (failure != 0 && !(named = interpreter_of(words[0])).empty()) {
        interpreter = usual_interpreter(named);
        if (!interpreter.empty()) {
            argv.insert(argv.begin(), interpreter.data());
            failure = posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ);
        }
    }
    posix_spawn_file_actions_destroy(&actions);
    close(in[1]), close(out[1]);
    if (failure != 0) {
        close(in[0]), close(out[0]);
        pid = -1;
        throw Error(named.empty() ? std::string("it cannot be started: ") + std::strerror(failure)
                                  : "it cannot be started: its first line names \"" + named +
                                        "\", which is not there; install that, or name another");
    }
    to = in[0], from = out[0];
}

std::string Programs::ask(const std::string& command, const std::vector<std::string>& folders,
                          const std::string& line, const Limits& limits) {
    std::unique_ptr<Program>& program = m_running[command];
    if (!program) {
        program = std::make_unique<Program>();
        try {
            start(command, folders, program->pid, program->to, program->from);
        } catch (...) {
            program.reset();
            throw;
        }
    }
    const auto fail = [&](const std::string& why) {
        program.reset();
        return Error(why);
    };
    // Both ways at once: a program may answer before it has read all.
    std::string answer = std::move(program->rest);
    program->rest.clear();
    size_t sent = 0, looked = 0;
    std::vector<char> buffer(1 << 16);
    for (;;) {
        // The byte 255; or what becomes of it where text is written as UTF-8, which no RIB holds either.
        const size_t end = std::min(answer.find('\377', looked), answer.find("\303\277", looked));
        if (end != std::string::npos) {
            program->rest = answer.substr(end + (answer[end] == '\377' ? 1 : 2));
            answer.resize(end);
            return answer;
        }
        looked = answer.empty() ? 0 : answer.size() - 1;
        if (answer.size() > limits.bytes)
            throw fail("its answer is longer than " + std::to_string(limits.bytes) + " bytes");
        pollfd fds[2] = {{program->from, POLLIN, 0}, {program->to, POLLOUT, 0}};
        const int ready = poll(fds, sent < line.size() ? 2 : 1, int(limits.seconds * 1000));
        if (ready < 0 && errno == EINTR)
            continue;
        if (ready <= 0)
            throw fail("it has been silent for " + std::to_string(int(limits.seconds)) + " seconds");
        if (sent < line.size() && fds[1].revents != 0) {
            const ssize_t n =
                send(program->to, line.data() + sent, line.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
            if (n < 0 && errno != EAGAIN && errno != EINTR)
                sent = line.size(); // it reads no more; perhaps it answers still
            else if (n > 0)
                sent += size_t(n);
        }
        if (fds[0].revents == 0)
            continue;
        const ssize_t n = read(program->from, buffer.data(), buffer.size());
        if (n < 0 && (errno == EINTR || errno == EAGAIN))
            continue;
        if (n > 0) {
            answer.append(buffer.data(), size_t(n));
            continue;
        }
        // It has ended: without the mark that is an answer too, if it ended well.
        int status = 0;
        if (waitpid(program->pid, &status, 0) == program->pid)
            program->pid = -1;
        program.reset();
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && !answer.empty())
            return answer;
        if (WIFEXITED(status))
            throw Error("it ended with status " + std::to_string(WEXITSTATUS(status)) +
                        (answer.empty() ? " and no answer" : ""));
        throw Error("it was ended by signal " + std::to_string(WTERMSIG(status)));
    }
}

} // namespace kanuka::ingest
