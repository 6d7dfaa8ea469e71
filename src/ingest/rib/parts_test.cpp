// The small parts: sources, declarations, spelling, search paths, conditions, reports.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <zlib.h>

#include "base/spelling.h"
#include "ingest/rib/condition.h"
#include "ingest/rib/reader.h"
#include "ingest/rib/search_path.h"

namespace kanuka::ingest {

namespace fs = std::filesystem;

class TempFolder {
  public:
    TempFolder() {
        std::string name = (fs::temp_directory_path() / "kanuka_rib_XXXXXX").string();
        m_path = mkdtemp(name.data());
    }
    ~TempFolder() { fs::remove_all(m_path); }
    std::string operator/(const std::string& name) const { return (m_path / name).string(); }

  private:
    fs::path m_path;
};

static void write(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

static std::string gzipped(const std::string& text) {
    std::string out(text.size() + 1000, '\0');
    z_stream z{};
    deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    z.avail_in = uInt(text.size());
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = uInt(out.size());
    deflate(&z, Z_FINISH);
    out.resize(z.total_out);
    deflateEnd(&z);
    return out;
}

TEST(Source, PlainGzipAndMembers) {
    TempFolder folder;
    const std::string a = "Sides 2\n", b = std::string(300000, ' ') + "Sides 1\n";
    write(folder / "plain.rib", a);
    write(folder / "packed.rib.gz", gzipped(a));
    write(folder / "two", gzipped(a) + gzipped(b)); // the name does not matter
    write(folder / "empty.rib", "");
    EXPECT_EQ(Source::open(folder / "plain.rib")->text(), a);
    EXPECT_EQ(Source::open(folder / "packed.rib.gz")->text(), a);
    EXPECT_EQ(Source::open(folder / "two")->text(), a + b);
    EXPECT_EQ(Source::open(folder / "empty.rib")->text(), "");
}

TEST(Source, FailuresNameTheFile) {
    TempFolder folder;
    const std::string packed = gzipped(std::string(10000, 'x') + "end");
    write(folder / "cut.gz", packed.substr(0, packed.size() / 2));
    std::string damaged = packed;
    damaged[packed.size() / 2] ^= 0x55;
    damaged[packed.size() - 6] ^= 0x55;
    write(folder / "damaged.gz", damaged);
    for (const char* name : {"cut.gz", "damaged.gz", "missing.rib", "."}) {
        try {
            Source::open(folder / name);
            ADD_FAILURE() << name << " was opened";
        } catch (const Error& e) {
            EXPECT_EQ(e.where().file, folder / name);
            EXPECT_EQ(e.code(), ExitCode::Input);
        }
    }
}

TEST(Source, Locations) {
    const auto s = Source::from_text("ab\ncd\n\nx", "f");
    EXPECT_EQ(s->locate(0).str(), "f:1:1");
    EXPECT_EQ(s->locate(4).str(), "f:2:2");
    EXPECT_EQ(s->locate(7).str(), "f:4:1");
    EXPECT_EQ(s->locate(1).str(), "f:1:2"); // backwards too
    EXPECT_EQ(s->locate(99).str(), "f:4:2");
}

TEST(Declarations, Forms) {
    std::string problem;
    const auto p = parse_declaration("vertex  point  P", true, problem);
    ASSERT_TRUE(p);
    EXPECT_EQ(p->name, "P");
    EXPECT_EQ(p->declaration.type, scene::Type::Point);
    EXPECT_EQ(p->declaration.detail, scene::Detail::Vertex);
    const auto st = parse_declaration("varying float[ 2.0 ] st", true, problem);
    ASSERT_TRUE(st);
    EXPECT_EQ(st->declaration.array_size, 2);
    EXPECT_EQ(st->name, "st");
    const auto tight = parse_declaration("integer[3]tiles", true, problem);
    ASSERT_TRUE(tight);
    EXPECT_EQ(tight->name, "tiles");
    EXPECT_EQ(tight->declaration.detail, scene::Detail::Uniform);
    EXPECT_TRUE(parse_declaration("uniform color", false, problem));
    const auto none = parse_declaration("int[0] x", true, problem); // Blender's exporter
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->declaration.open_array);
    for (const char* bad : {"uniform", "uniform colour Cs", "float[-1] a", "float[2 a", "float[1e9] a",
                            "float a b", "float", ""}) {
        problem.clear();
        EXPECT_FALSE(parse_declaration(bad, true, problem)) << bad;
        EXPECT_FALSE(problem.empty()) << bad;
    }
}

TEST(Declarations, StandardOnesAreThere) {
    const Declarations d;
    ASSERT_TRUE(d.find("P"));
    EXPECT_EQ(d.find("P")->type, scene::Type::Point);
    EXPECT_EQ(d.find("Cs")->type, scene::Type::Color);
    EXPECT_EQ(d.find("st")->array_size, 2);
    EXPECT_EQ(d.find("Pw")->type, scene::Type::HPoint);
    EXPECT_EQ(d.find("bucketsize")->array_size, 2);
    EXPECT_EQ(d.find("nothing"), nullptr);
    EXPECT_EQ(d.nearest("intensty"), "intensity");
}

TEST(Spelling, Distance) {
    EXPECT_EQ(edit_distance("abc", "abc"), 0);
    EXPECT_EQ(edit_distance("Sphere", "Shpere"), 1); // neighbours swapped
    EXPECT_EQ(edit_distance("", "abc"), 3);
    EXPECT_LT(edit_distance("worldbegin", "WorldBegin"), 1);
    EXPECT_EQ(nearest_request("Shpere"), "Sphere");
    EXPECT_EQ(nearest_request("worldbegin"), "WorldBegin");
    EXPECT_EQ(nearest_request("PointsPolygon"), "PointsPolygons");
    EXPECT_EQ(nearest_request("Xyzzy"), "");
}

TEST(SearchPath, AmpersandAtAndFolders) {
    using V = std::vector<std::string>;
    EXPECT_EQ(expand_search_path("a:&", {"x", "y"}, {"d"}, ""), (V{"a", "x", "y"}));
    EXPECT_EQ(expand_search_path("&:a:@", {"x"}, {"d"}, "/scene"), (V{"x", "/scene/a", "a", "d"}));
    EXPECT_EQ(expand_search_path("/abs::.:/abs", {}, {}, "s"), (V{"/abs", "s", "."}));
    ::setenv("KANUKA_TEST_PATH", "/from/env", 1);
    EXPECT_EQ(expand_search_path("$KANUKA_TEST_PATH/a:${KANUKA_TEST_PATH}", {}, {}, ""),
              (V{"/from/env/a", "/from/env"}));
}

TEST(SearchPath, FindsFilesNotFolders) {
    TempFolder folder;
    fs::create_directory(folder / "sub");
    write(folder / "sub/a.rib", "x");
    EXPECT_EQ(find_file("a.rib", {folder / "", folder / "sub"}), folder / "sub/a.rib");
    EXPECT_FALSE(find_file("sub", {folder / ""}));
    EXPECT_FALSE(find_file("b.rib", {folder / "sub"}));
}

TEST(Condition, Expressions) {
    Journal journal;
    const auto source = Source::from_text("", "t");
    Reader reader(journal, {}, {}, *source);
    Context& c = reader.context();
    scene::Value v;
    v.name = "user:quality";
    v.type = scene::Type::String;
    v.strings = std::vector<std::string>{"high"};
    c.options.options.user.set(v);
    scene::Value n;
    n.name = "user:level";
    n.floats = std::vector<float>{3};
    c.attributes.edit(FieldUser).user.set(n);
    const auto holds = [&](const char* text) {
        std::string problem;
        const bool r = evaluate_condition(text, c, problem);
        EXPECT_EQ(problem, "") << text;
        return r;
    };
    EXPECT_TRUE(holds("1"));
    EXPECT_FALSE(holds("0"));
    EXPECT_TRUE(holds("$user:quality == 'high'"));
    EXPECT_FALSE(holds("$user:quality != 'high'"));
    EXPECT_TRUE(holds("$Attribute:user:level >= 3 && !($user:level > 3)"));
    EXPECT_TRUE(holds("1 + 2 * 3 == 7 || 0"));
    EXPECT_TRUE(holds("(1 + 2) * 3 == 9"));
    EXPECT_TRUE(holds("defined(user:level)"));
    EXPECT_FALSE(holds("defined(user:nothing)"));
    EXPECT_TRUE(holds("$user:nothing == ''"));
    EXPECT_FALSE(holds("$user:quality == 0"));
    for (const char* bad : {"", "1 +", "(1", "'open", "1 2", "defined user:x", "@"}) {
        std::string problem;
        EXPECT_FALSE(evaluate_condition(bad, c, problem) && problem.empty()) << bad;
        EXPECT_FALSE(problem.empty()) << bad;
    }
    std::string problem;
    evaluate_condition(std::string(100000, '('), c, problem);
    EXPECT_NE(problem.find("deep"), std::string::npos);
}

TEST(Reports, AreBounded) {
    Journal journal;
    Reports reports(journal);
    for (int i = 1; i <= 1000; i++)
        reports.error("sort", {"f", i, 1}, "message");
    EXPECT_EQ(journal.entries().size(), size_t(Reports::MaxPlaces + 1));
    EXPECT_EQ(journal.error_count(), 1000u);
    for (int i = 1; i <= 10; i++)
        reports.once(Severity::Warning, "key", {"g", i, 1}, "other");
    EXPECT_EQ(journal.entries().back().count, 10u);
    EXPECT_EQ(journal.entries().back().where.line, 1);
}

} // namespace kanuka::ingest
