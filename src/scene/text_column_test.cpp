#include "scene/text_column.h"

#include <gtest/gtest.h>

#include "scene/edit_checks.h"

namespace kanuka::scene::test {

namespace {

Variation with(Value value) {
    Variation variation;
    variation.primvars.set(std::move(value));
    return variation;
}

Value text(std::vector<std::string> texts, std::vector<int32_t> numbers, int array_size = 1) {
    Value value{.name = "tex", .type = Type::String, .detail = Detail::Uniform, .array_size = array_size};
    value.strings = std::move(texts);
    value.ints = std::move(numbers);
    return value;
}

} // namespace

// Two texts that make one are not the other two.
TEST(TextColumn, ValuesOfSeveralTextsAreToldApart) {
    const std::vector<std::vector<std::string>> said = {{"a", "bc"}, {"ab", "c"},   {"a", "bc"},
                                                        {"", "abc"}, {"1:a", "bc"}, {"ab", "c"}};
    TextColumn column(2);
    for (const auto& each : said)
        column.add(std::span(each));
    Value value{.name = "pair", .type = Type::String, .array_size = 2};
    column.move_to(value);
    EXPECT_EQ(value.strings.size(), 8u);
    EXPECT_EQ(value.detail, Detail::Uniform);
    for (size_t i = 0; i < said.size(); i++) {
        const auto found = texts_of(value, i);
        EXPECT_EQ(std::vector<std::string>(found.begin(), found.end()), said[i]);
    }
    EXPECT_FALSE(fault_of(with(value), said.size()));
    EXPECT_TRUE(fault_of(with(value), said.size() + 1));
}

TEST(TextColumn, OneIsConstant) {
    TextColumn column;
    const std::string_view a = "a";
    column.add(std::span(&a, 1));
    Value value{.name = "tex", .type = Type::String};
    column.move_to(value);
    EXPECT_EQ(value.detail, Detail::Constant);
    EXPECT_TRUE(value.ints.empty());
    EXPECT_EQ(texts_of(value, 0)[0], "a");
    EXPECT_FALSE(fault_of(with(value), 1));
    EXPECT_FALSE(fault_of(with(value), 5));
}

TEST(TextColumn, NumbersWithoutATextAreFaults) {
    EXPECT_FALSE(fault_of(with(text({"a", "b"}, {0, 1, 1})), 3));
    EXPECT_TRUE(fault_of(with(text({"a", "b"}, {0, 2, 1})), 3));
    EXPECT_TRUE(fault_of(with(text({"a", "b"}, {0, -1, 1})), 3));
    EXPECT_TRUE(fault_of(with(text({"a", "b", "c"}, {0, 0, 0}, 2)), 3));
    EXPECT_TRUE(fault_of(with(text({"a", "b", "c"}, {})), 3));
    EXPECT_TRUE(fault_of(with(text({}, {0})), 1));
}

} // namespace kanuka::scene::test
