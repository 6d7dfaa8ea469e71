// A file of a test's own.
#pragma once

#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

namespace kanuka::store::testing {

// A file of its own, gone at the end.
class TemporaryFile {
  public:
    TemporaryFile()
        : m_path((std::filesystem::temp_directory_path() /
                  ("kanuka_store_test_" + std::to_string(std::random_device()()) + ".page"))
                     .string()) {}
    ~TemporaryFile() { std::filesystem::remove(m_path); }
    const std::string& path() const { return m_path; }
    std::vector<char> bytes() const {
        std::ifstream f(m_path, std::ios::binary);
        return {std::istreambuf_iterator<char>(f), {}};
    }
    void write(const std::vector<char>& bytes) const {
        std::ofstream f(m_path, std::ios::binary | std::ios::trunc);
        f.write(bytes.data(), std::streamsize(bytes.size()));
    }

  private:
    std::string m_path;
};

} // namespace kanuka::store::testing
