// Archives in zip files: found, read, and harmless where they are broken.

#include <filesystem>
#include <fstream>
#include <unistd.h>
#include <zlib.h>

#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

namespace fs = std::filesystem;

static void put(std::string& to, uint32_t value, int bytes) {
    for (int i = 0; i < bytes; i++)
        to += char(value >> (8 * i) & 255);
}

static std::string deflated(const std::string& text) {
    std::string out(text.size() + 1000, '\0');
    z_stream z{};
    deflateInit2(&z, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY);
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    z.avail_in = uInt(text.size());
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = uInt(out.size());
    deflate(&z, Z_FINISH);
    out.resize(z.total_out);
    deflateEnd(&z);
    return out;
}

struct ZipFile {
    std::string bytes, directory;
    int members = 0;

    void add(const std::string& name, const std::string& text, bool pack) {
        const std::string data = pack ? deflated(text) : text;
        const auto crc = uint32_t(crc32(0, reinterpret_cast<const Bytef*>(text.data()), uInt(text.size())));
        const auto common = [&](std::string& to) {
            put(to, 20, 2), put(to, 0, 2), put(to, pack ? 8 : 0, 2), put(to, 0, 4), put(to, crc, 4);
            put(to, uint32_t(data.size()), 4), put(to, uint32_t(text.size()), 4);
            put(to, uint32_t(name.size()), 2);
        };
        const auto offset = uint32_t(bytes.size());
        bytes += "PK\3\4";
        common(bytes);
        put(bytes, 3, 2); // an extra field, which the directory has not
        bytes += name + "xyz" + data;
        directory += "PK\1\2";
        put(directory, 20, 2);
        common(directory);
        put(directory, 0, 2), put(directory, 0, 2), put(directory, 0, 4), put(directory, 0, 4);
        put(directory, offset, 4);
        directory += name;
        members++;
    }
    std::string whole() const {
        std::string all = bytes + directory + "PK\5\6";
        put(all, 0, 4), put(all, uint32_t(members), 2), put(all, uint32_t(members), 2);
        put(all, uint32_t(directory.size()), 4), put(all, uint32_t(bytes.size()), 4), put(all, 7, 2);
        return all + "comment";
    }
};

struct Zip : testing::Test {
    fs::path folder =
        fs::temp_directory_path() / ("kanuka_zip_" + std::to_string(::getpid()) + "_" +
                                     testing::UnitTest::GetInstance()->current_test_info()->name());
    ZipFile zip;

    Zip() { fs::create_directories(folder); }
    ~Zip() override { fs::remove_all(folder); }

    void write(const std::string& name, const std::string& content) const {
        fs::create_directories((folder / name).parent_path());
        std::ofstream(folder / name, std::ios::binary) << content;
    }
    Parsed read(const std::string& name) const {
        RibOptions options;
        options.archive_path = {folder.string()};
        return Parsed(world("ReadArchive \"" + name + "\""), options);
    }
};

TEST_F(Zip, MembersAreReadStoredAndDeflated) {
    zip.add("renderman/job/a.rib", "Sphere 1 -1 1 360\nReadArchive \"b.rib\"\n", false);
    zip.add("renderman/job/b.rib", std::string(1000, ' ') + "Disk 0 1 360 Disk 1 1 360", true);
    zip.add("top.rib", "ReadArchive \"renderman/job/b.rib\" ReadArchive \"beside.rib\"", true);
    write("geo/cache.job.zip", zip.whole());
    const Parsed r = read("geo/cache.job.zip!renderman/job/a.rib");
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.primitives.size(), 3u) << "and an archive finds others of its zip";
    EXPECT_EQ(r.primitive(0).where.file, (folder / "geo/cache.job.zip!renderman/job/a.rib").string());
    const Parsed top = read("geo/cache.job.zip!top.rib");
    EXPECT_EQ(top.scene.primitives.size(), 2u);
    EXPECT_TRUE(top.says("\"beside.rib\" was left out: the file is not in \"" +
                         (folder / "geo/cache.job.zip!").string()))
        << top.all_messages();
    // A path of another machine.
    EXPECT_EQ(read("E:/maya/geo/cache.job.zip!renderman/job/b.rib").scene.primitives.size(), 2u);
    const Parsed none = read("geo/cache.job.zip!c.rib");
    EXPECT_TRUE(none.says("\"geo/cache.job.zip!c.rib\" was left out")) << none.all_messages();
    EXPECT_TRUE(read("no.zip!c.rib").says("was left out"));
}

TEST_F(Zip, BrokenOnesAreToldAndDoNoHarm) {
    std::string body;
    for (int i = 0; i < 300; i++)
        body += "Sphere " + std::to_string(i + 1) + " -1 1 360\n";
    zip.add("a.rib", body, true);
    zip.add("b.rib", "Disk 0 1 360", false);
    const std::string good = zip.whole();
    const auto spheres = [&](const std::string& content) {
        write("z.zip", content);
        const Parsed r = read("z.zip!a.rib");
        if (r.scene.primitives.empty()) {
            EXPECT_GE(r.journal.error_count(), 1u);
        }
        return r.scene.primitives.size();
    };
    EXPECT_EQ(spheres(good), 300u);
    for (size_t length = 0; length < good.size() - 7; length += 7)
        EXPECT_EQ(spheres(good.substr(0, length)), 0u) << length;
    // Every byte turned over: whole, or nothing and said.
    for (size_t at = 0; at < good.size(); at++) {
        std::string bad = good;
        bad[at] = char(bad[at] ^ (at % 2 ? 0xff : 0x10));
        const size_t n = spheres(bad);
        EXPECT_TRUE(n == 0 || n == 300) << at;
    }
    // A bomb gives no more than it says.
    ZipFile bomb;
    bomb.add("a.rib", std::string(size_t(100) << 20, ' '), true);
    std::string content = bomb.whole();
    const size_t entry = content.find("PK\1\2");
    content[entry + 24] = 100, content[entry + 25] = content[entry + 26] = content[entry + 27] = 0;
    write("z.zip", content);
    EXPECT_TRUE(read("z.zip!a.rib").says("longer than the directory says"));
}

} // namespace kanuka::ingest::test
