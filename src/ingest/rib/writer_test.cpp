// The writer and the converter: every coat says the same.

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "ingest/rib/convert.h"
#include "ingest/rib/test_support.h"
#include "ingest/rib/writer.h"
#include "scene/summary.h"

namespace kanuka::ingest::test {

namespace fs = std::filesystem;

static std::string convert(const std::string& text, bool binary) {
    Journal journal;
    return convert_text(text, "test.rib", {.binary = binary}, journal);
}

static void expect_fixed_point(const std::string& text, const std::string& name) {
    Journal journal;
    const std::string ascii = convert_text(text, name, {}, journal);
    EXPECT_TRUE(convert(ascii, false) == ascii) << name;
    const std::string binary = convert(text, true);
    EXPECT_TRUE(convert(binary, false) == ascii) << name;
    EXPECT_TRUE(convert(binary, true) == binary) << name;
    EXPECT_TRUE(convert(ascii, true) == binary) << name;
}

// Two scenes say the same, bit by bit.
static void expect_same(const scene::ValueList& a, const scene::ValueList& b) {
    ASSERT_EQ(a.values.size(), b.values.size());
    for (size_t i = 0; i < a.values.size(); i++) {
        const scene::Value &x = a.values[i], &y = b.values[i];
        EXPECT_EQ(x.name, y.name);
        EXPECT_EQ(x.type, y.type);
        EXPECT_EQ(x.detail, y.detail);
        EXPECT_EQ(x.array_size, y.array_size);
        EXPECT_TRUE(std::ranges::equal(x.ints, y.ints));
        EXPECT_TRUE(std::ranges::equal(x.strings, y.strings));
        ASSERT_EQ(x.floats.size(), y.floats.size());
        EXPECT_EQ(x.floats.size() ? memcmp(x.floats.data(), y.floats.data(), 4 * x.floats.size()) : 0, 0);
    }
}

static void expect_same_scenes(const std::string& a_text, const std::string& b_text,
                               const std::string& name) {
    Journal a_journal, b_journal;
    const scene::Scene a = parse_rib(a_text, name, {}, a_journal), b = parse_rib(b_text, name, {}, b_journal);
    EXPECT_EQ(scene::to_json(scene::summarize(a)), scene::to_json(scene::summarize(b))) << name;
    EXPECT_EQ(a_journal.error_count(), b_journal.error_count()) << name;
    ASSERT_EQ(a.primitives.size(), b.primitives.size()) << name;
    for (size_t i = 0; i < a.primitives.size(); i++) {
        expect_same(a.primitives[i].primvars, b.primitives[i].primvars);
        EXPECT_EQ(a.primitives[i].world_from_object, b.primitives[i].world_from_object);
        if (a.primitives[i].attributes->surface)
            expect_same(a.primitives[i].attributes->surface->parameters,
                        b.primitives[i].attributes->surface->parameters);
    }
}

TEST(Writer, CanonicalForm) {
    EXPECT_EQ(
        convert("##RenderMan RIB\n\n# one\nversion 3.030\n  Sphere\t1.0 -1 1 3.6e2 # two\n"
                "Color 1 .5 0\nSurface \"matte\" \"Kd\" 0.10000000149 \"string s\" \"a\\\"b\\n\"\n"
                "PointsPolygons [3] # inside\n [0 1 2] \"P\" [0 0 -0 1e20 0 0 0 1 16777217]\n"
                "DepthOfField\nLightSource \"x\" \"key\"Illuminate \"key\" 1\nTransform 1 0 0 0 0 1 0 0 0 "
                "0 1 0 0 0 0 1",
                false),
        "##RenderMan RIB\n# one\nversion 3.03\nSphere 1 -1 1 360\n# two\nColor [1 0.5 0]\n"
        "Surface \"matte\" \"Kd\" [0.1] \"string s\" [\"a\\\"b\\n\"]\n# inside\n"
        "PointsPolygons [3] [0 1 2] \"P\" [0 0 -0 1e+20 0 0 0 1 16777216]\nDepthOfField\n"
        "LightSource \"x\" \"key\"\nIlluminate \"key\" 1\n"
        "Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]\n");
}

TEST(Writer, IntegersKeepAllTheirDigits) {
    const std::string text =
        "Declare \"big\" \"uniform integer\"\nOption \"x\" \"big\" [2147483647] \"uniform "
        "integer[2] two\" [-2147483648 16777217]\n";
    EXPECT_EQ(convert(text, false), text);
    EXPECT_EQ(convert(convert(text, true), false), text);
}

TEST(Writer, VerbatimTextGoesOnWhereItEnds) {
    for (const auto form : {Writer::Form::Ascii, Writer::Form::Binary}) {
        std::string text;
        {
            const auto output = output_to(text);
            Writer writer(*output, form);
            Call sides;
            sides.spec = find_request("Sides");
            sides.args[0].given = true;
            sides.args[0].number = 1;
            writer.call(sides);
            writer.verbatim("Format ");
            writer.verbatim("64 48 1");
            writer.call(sides);
            writer.verbatim("# one\n\n# two\n");
            writer.verbatim("# three");
            writer.comment("#four");
            writer.verbatim("");
            writer.verbatim("# five");
            writer.flush();
        }
        EXPECT_EQ(convert(text, false),
                  "Sides 1\nFormat 64 48 1\nSides 1\n# one\n# two\n# three\n#four\n# five\n");
        if (form == Writer::Form::Ascii) {
            EXPECT_EQ(text, "Sides 1\nFormat 64 48 1\nSides 1\n# one\n\n# two\n# three\n#four\n# five\n");
        }
    }
}

TEST(Writer, UnknownRequestsStay) {
    const std::string text = "MyRequest \"a\" [1 2.5] \"b\" [\"c\"]\nSphere 1 -1 1 360\n";
    EXPECT_EQ(convert(text, false), text);
    EXPECT_EQ(convert(convert(text, true), false), text);
}

TEST(Writer, RequestsWithoutANameGo) { // found by fuzzing: a code that is defined as the empty string
    const std::string text = "Sides 2\n\314\001\220\246\001 1 2\nSphere 1 -1 1 360\n";
    EXPECT_EQ(convert(text, false), "Sides 2\nSphere 1 -1 1 360\n");
    expect_fixed_point(text, "nameless");
}

TEST(Writer, RoundTripsOfEverything) {
    std::string text = "##RenderMan RIB-Structure 1.1\nversion 3.04\n";
    for (int i = 0; i < 700; i++) // more strings than one byte counts
        text += "Attribute \"user\" \"uniform float name" + std::to_string(i) + "\" [" +
                std::to_string(i * 0.37) + "]\n";
    text +=
        "Declare \"st\" \"facevarying float[2]\"\nWorldBegin\nArchiveBegin \"a\"\nSphere 1 -1 1 360 "
        "\"varying float x\" [1 2 3 4]\nArchiveEnd\nReadArchive \"a\"\nIfBegin \"1 == 2\"\nElse\nDisk 0 1 "
        "360\nIfEnd\nMotionBegin [0 1]\nTranslate 0 0 1\nTranslate 0 .1 1\nMotionEnd\nBasis \"bezier\" 3 [1 "
        "0 0 0 0 1 0 0 0 0 1 0 0 0 0 1] 3\nSubdivisionMesh \"catmull-clark\" [4] [0 1 2 3] [\"crease\"] [2 "
        "1] [0 1] [2.5] \"P\" [0 0 0 1 0 0 1 1 0 0 1 0]\nWorldEnd\n";
    expect_fixed_point(text, "everything");
    expect_same_scenes(text, convert(text, false), "ascii");
    expect_same_scenes(text, convert(text, true), "binary");
}

static std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Writer, RoundTripsOfScenes) {
    const char* shared = std::getenv("KANUKA_SHARED");
    int files = 0;
    for (const fs::path& root : {fs::path(KANUKA_SOURCE_DIR "/scenes"),
                                 fs::path(shared ? shared : KANUKA_SOURCE_DIR "/../shared") / "scenes/rib"}) {
        if (!fs::exists(root))
            continue;
        for (const auto& entry : fs::recursive_directory_iterator(root)) {
            if (entry.path().extension() != ".rib")
                continue;
            files++;
            const std::string text = bytes_of(entry.path());
            expect_fixed_point(text, entry.path().string());
            expect_same_scenes(text, convert(text, true), entry.path().string());
        }
    }
    EXPECT_GT(files, 2);
}

TEST(Convert, PacksAndExpands) {
    std::string name = (fs::temp_directory_path() / "kanuka_convert_XXXXXX").string();
    const fs::path folder = mkdtemp(name.data());
    std::ofstream(folder / "part.rib") << "# part\nSphere 1 -1 1 360\n";
    std::ofstream(folder / "all.rib")
        << "WorldBegin\nReadArchive \"part.rib\"\nProcedural \"DelayedReadArchive\" "
           "[\"part.rib\"] [-1 1 -1 1 -1 1]\nReadArchive \"no.rib\"\nWorldEnd\n";
    const std::string all = (folder / "all.rib").string();
    for (const char* packed : {"out.rib", "out.rib.gz", "out.rib.zst"}) {
        Journal journal;
        const std::string out = (folder / packed).string();
        convert_rib(all, out, {.binary = true, .packing = packing_by_name(out)}, journal);
        EXPECT_EQ(journal.error_count(), 0u);
        convert_rib(out, (folder / "back.rib").string(), {}, journal);
        EXPECT_EQ(bytes_of(folder / "back.rib"), bytes_of(all)) << packed;
        EXPECT_NE(bytes_of(out), bytes_of(all));
    }
    Journal journal;
    convert_rib(all, (folder / "one.rib").string(), {.expand_archives = true}, journal);
    EXPECT_EQ(journal.error_count(), 1u); // no.rib
    EXPECT_EQ(
        bytes_of(folder / "one.rib"),
        "WorldBegin\n# part\nSphere 1 -1 1 360\nAttributeBegin\n# part\nSphere 1 -1 1 360\nAttributeEnd\n"
        "ReadArchive \"no.rib\"\nWorldEnd\n");
    EXPECT_FALSE(fs::exists(folder / "one.rib.part"));
    EXPECT_THROW(convert_rib(all, (folder / "none/out.rib").string(), {}, journal), Error);
    fs::remove_all(folder);
}

} // namespace kanuka::ingest::test
