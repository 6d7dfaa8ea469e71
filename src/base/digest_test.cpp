#include "base/digest.h"

#include <gtest/gtest.h>

namespace kanuka {
namespace {

TEST(Digest, EqualContentEqualDigest) {
    const auto of = [](std::vector<float> v, std::string s) {
        return digest_of(v, s, std::optional<int>(3), std::array<double, 2>{1, 2});
    };
    EXPECT_EQ(of({1, 2}, "a"), of({1, 2}, "a"));
    EXPECT_NE(of({1, 2}, "a"), of({1, 2}, "b"));
    EXPECT_NE(of({1, 2}, "a"), of({2, 1}, "a"));
    EXPECT_NE(of({1, 2}, "a"), of({1}, "a"));
}

// Neighbours do not run together, and nothing differs from something that holds nothing.
TEST(Digest, LengthsCount) {
    using Texts = std::vector<std::string>;
    EXPECT_NE(digest_of(Texts{"ab", "c"}), digest_of(Texts{"a", "bc"}));
    EXPECT_NE(digest_of(Texts{""}), digest_of(Texts{}));
    EXPECT_NE(digest_of(std::optional<int>()), digest_of(std::optional<int>(0)));
    EXPECT_NE(digest_of(std::shared_ptr<int>()), digest_of(std::make_shared<int>(0)));
    using Either = std::variant<int32_t, uint32_t>;
    EXPECT_NE(digest_of(Either(int32_t(1))), digest_of(Either(uint32_t(1))));
}

// What is pointed at counts, not where it lies.
TEST(Digest, PointersAreWhatTheyPointAt) {
    EXPECT_EQ(digest_of(std::make_shared<int>(7)), digest_of(std::make_shared<int>(7)));
    EXPECT_NE(digest_of(std::make_shared<int>(7)), digest_of(std::make_shared<int>(8)));
}

// Published value of XXH3-128 of no bytes (xxhash's own test vectors): files outlive builds.
TEST(Digest, IsXxh3) {
    EXPECT_EQ(Digester().digest().text(), "99aa06d3014798d86001c324468d497f");
}

} // namespace
} // namespace kanuka
