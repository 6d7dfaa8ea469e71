#include "film/atomic_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/error.h"

namespace kanuka::film {

AtomicFile::AtomicFile(std::string path) : m_path(std::move(path)) {
    const size_t slash = m_path.rfind('/');
    m_directory = slash == std::string::npos ? "." : slash == 0 ? "/" : m_path.substr(0, slash);
    std::string name = slash == std::string::npos ? m_path : m_path.substr(slash + 1);
    struct stat status;
    if (name.empty() || (stat(m_path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)))
        throw Error(Location{m_path}, "is a directory; give the name of a picture", ExitCode::Output);
    // The longest name a file may have is 255 bytes; the suffix needs some of them.
    constexpr size_t LongestStem = 200;
    if (name.size() > LongestStem)
        name.resize(LongestStem);
    for (int count = 0; m_file < 0; count++) {
        m_temporary = m_directory + "/." + name + "." + std::to_string(getpid()) + "-" +
                      std::to_string(count) + ".part";
        // Exclusive: two threads, or a leftover with a recycled process id, never share a file.
        m_file = open(m_temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (m_file < 0 && errno != EEXIST)
            fail("cannot be created");
    }
}

AtomicFile::~AtomicFile() {
    if (m_file >= 0) {
        close(m_file);
        unlink(m_temporary.c_str());
    }
}

void AtomicFile::fail(const char* doing) const {
    const int code = errno;
    throw Error(Location{m_path}, std::string(doing) + ": " + std::strerror(code), ExitCode::Output);
}

void AtomicFile::write(const void* data, size_t size) {
    const char* bytes = static_cast<const char*>(data);
    while (size > 0) {
        const ssize_t done = pwrite(m_file, bytes, size, off_t(m_position));
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            fail("cannot be written");
        bytes += done;
        size -= size_t(done);
        m_position += uint64_t(done);
    }
}

void AtomicFile::commit() {
    if (fsync(m_file) != 0)
        fail("cannot be written to the disk");
    if (rename(m_temporary.c_str(), m_path.c_str()) != 0)
        fail("cannot be replaced");
    const int file = m_file;
    m_file = -1;
    if (close(file) != 0)
        fail("cannot be closed");
    // The rename itself is on the disk once the directory is; some file systems cannot sync one, which does
    // no harm.
    const int directory = open(m_directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory >= 0) {
        fsync(directory);
        close(directory);
    }
}

} // namespace kanuka::film
