#include "shade/search.h"

#include "shade/test_support.h"

namespace kanuka::shade {
namespace {

constexpr const char* Extensions[] = {".slo", ".sl"};

TEST(Search, PathThenSceneFolderThenStandard) {
    const auto folders = search_folders({"/a", "b", "@"}, "/scenes/x.rib", "/standard");
    EXPECT_EQ(join_folders(folders), "\"/a\", \"b\", \"/scenes/b\", \"/standard\", \"/scenes\"");
    EXPECT_EQ(join_folders(search_folders({}, "x.rib", "/standard")), "\".\", \"/standard\"");
}

TEST(Search, FirstFolderWinsAndSloBeforeSl) {
    test::TemporaryFolder root;
    root.write("one/wood.sl", "");
    const std::string slo = root.write("two/wood.slo", "");
    root.write("two/wood.sl", "");
    const std::string one = root.str() + "/one", two = root.str() + "/two";
    EXPECT_EQ(find_file("wood", std::vector{two, one}, Extensions), slo);
    EXPECT_EQ(find_file("wood", std::vector{one, two}, Extensions), one + "/wood.sl");
    EXPECT_EQ(find_file("oak", std::vector{one, two}, Extensions), std::nullopt);
    EXPECT_EQ(find_file(two + "/wood", {}, Extensions), slo) << "absolute names need no folders";
}

TEST(Search, FoldersAndOddNamesAreNotFiles) {
    test::TemporaryFolder root;
    root.write("wood.sl/inside", "");
    EXPECT_EQ(find_file("wood", std::vector{root.str()}, Extensions), std::nullopt);
    EXPECT_EQ(find_file("", std::vector{root.str()}, Extensions), std::nullopt);
    EXPECT_EQ(find_file(std::string(5000, 'x'), std::vector{root.str()}, Extensions), std::nullopt);
}

} // namespace
} // namespace kanuka::shade
