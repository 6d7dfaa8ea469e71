#include "ingest/rib/lexer.h"

#include <gtest/gtest.h>
#include <random>

#include "ingest/rib/number.h"
#include "ingest/rib/requests.h"

namespace kanuka::ingest {

static Lexer lex(const std::string& text) {
    Lexer lexer(Source::from_text(text, "t"), 0, text.size());
    lexer.is_request = [](std::string_view w) { return find_request(w) != nullptr; };
    return lexer;
}

static double scan(const std::string& s) {
    const ScannedNumber n = scan_number(s.data(), s.data() + s.size());
    EXPECT_EQ(n.end, s.data() + s.size()) << s;
    return n.value;
}

TEST(Number, Forms) {
    EXPECT_EQ(scan("0"), 0);
    EXPECT_EQ(scan("-7"), -7);
    EXPECT_EQ(scan("+7.5"), 7.5);
    EXPECT_EQ(scan(".5"), 0.5);
    EXPECT_EQ(scan("5."), 5);
    EXPECT_EQ(scan("1e-3"), 1e-3);
    EXPECT_EQ(scan("1E+38"), 1e38);
    EXPECT_EQ(scan("-1.99124e-15"), -1.99124e-15);
    EXPECT_EQ(scan("123456789012345678901234567890"), 123456789012345678901234567890.0);
    EXPECT_EQ(scan("1e999"), std::numeric_limits<double>::max());
    EXPECT_EQ(scan("1e-999"), 0);
    for (const char* bad : {"", "-", ".", "+.", "e5", "-e"})
        EXPECT_EQ(scan_number(bad, bad + strlen(bad)).end, nullptr) << bad;
    const std::string tail = "3exit"; // not an exponent
    EXPECT_EQ(scan_number(tail.data(), tail.data() + tail.size()).end, tail.data() + 1);
}

// Against the C library, for doubles and floats: random decimals of all lengths, and decimals that lie close
// to or exactly between two floats.
TEST(Number, RoundsCorrectly) {
    std::mt19937_64 random(1);
    char text[80];
    for (int i = 0; i < 200000; i++) {
        const float f = std::bit_cast<float>(uint32_t(random()));
        if (!std::isfinite(f))
            continue;
        const double middle = double(f) + (double(std::nextafterf(f, 1e38f)) - double(f)) / 2;
        switch (i % 4) {
        case 0:
            std::snprintf(text, sizeof text, "%.*g", int(random() % 9) + 1, double(f));
            break;
        case 1:
            std::snprintf(text, sizeof text, "%.*f", int(random() % 12),
                          double(f) / (std::abs(f) > 1e10f ? 1e30 : 1));
            break;
        case 2:
            std::snprintf(text, sizeof text, "%.17g", middle);
            break;
        default:
            std::snprintf(text, sizeof text, "%.*e", int(random() % 25), middle);
        }
        const char* end = text + strlen(text);
        const ScannedNumber n = scan_number(text, end);
        ASSERT_EQ(n.end, end) << text;
        ASSERT_EQ(n.value, std::strtod(text, nullptr)) << text;
        const float reference = std::strtof(text, nullptr);
        const float largest = std::copysign(std::numeric_limits<float>::max(), reference);
        ASSERT_EQ(to_float(n, text), std::isfinite(reference) ? reference : largest) << text;
    }
}

TEST(Lexer, TokensAndComments) {
    Lexer l = lex("##RenderMan RIB\nSurface# glued\n \"matte\" [1 -2.5e1]# end");
    EXPECT_EQ(l.peek(), Token::Word);
    EXPECT_EQ(l.word(), "Surface");
    EXPECT_EQ(l.peek(), Token::String);
    EXPECT_EQ(l.where().line, 3);
    EXPECT_EQ(l.where().column, 2);
    EXPECT_EQ(l.string(), "matte");
    EXPECT_EQ(l.peek(), Token::Open);
    l.skip();
    EXPECT_EQ(l.number(), 1);
    EXPECT_EQ(l.peek(), Token::Number);
    EXPECT_EQ(l.number(), -25);
    EXPECT_EQ(l.peek(), Token::Close);
    l.skip();
    EXPECT_EQ(l.peek(), Token::End);
}

TEST(Lexer, StringEscapes) {
    Lexer l = lex(R"("a\"b\\c\n\t\101\z" "two\
lines" "raw
break")");
    l.peek();
    EXPECT_EQ(l.string(), "a\"b\\c\n\tAz");
    l.peek();
    EXPECT_EQ(l.string(), "twolines");
    l.peek();
    EXPECT_EQ(l.string(), "raw\nbreak");
    EXPECT_FALSE(l.unterminated());
    EXPECT_EQ(l.peek(), Token::End);
}

TEST(Lexer, ForgottenQuoteEndsAtTheLineBeforeARequest) {
    Lexer l = lex("Surface \"matte\nColor [1 1 1]\nSurface \"plastic\"");
    l.peek();
    l.word();
    l.peek();
    EXPECT_EQ(l.string(), "matte");
    EXPECT_TRUE(l.unterminated());
    l.peek();
    EXPECT_EQ(l.word(), "Color");
}

TEST(Lexer, Arrays) {
    Lexer l = lex("[1 2.5\n# a comment 9\n-3 4#glued\n 5]");
    l.peek();
    l.skip();
    std::vector<float> v;
    l.numbers(v);
    EXPECT_EQ(v, (std::vector<float>{1, 2.5f, -3, 4, 5}));
    EXPECT_EQ(l.peek(), Token::Close);

    Lexer k = lex("[0 1.0 -2 2147483648 1e3 2.75 123456789012 ]");
    k.peek();
    k.skip();
    std::vector<int32_t> ints;
    size_t fractions = 0;
    k.integers(ints, fractions);
    EXPECT_EQ(ints, (std::vector<int32_t>{0, 1, -2, 2147483647, 1000, 2, 2147483647}));
    EXPECT_EQ(fractions, 1u);
    EXPECT_EQ(k.peek(), Token::Close);
}

TEST(Lexer, NumbersThatAreNone) {
    Lexer l = lex("[1 nan -inf 1.#QNAN0 -1.#IND00 -nan(ind) 2]");
    l.peek();
    l.skip();
    std::vector<float> v;
    l.numbers(v);
    EXPECT_EQ(v, (std::vector<float>{1, 0, 0, 0, 0, 0, 2}));
    EXPECT_EQ(l.not_finite, 5u);
}

TEST(Lexer, CarriageReturnsAloneEndLines) {
    Lexer l = lex("# comment\rSides 2\r");
    l.peek();
    EXPECT_EQ(l.where().line, 2);
    EXPECT_EQ(l.word(), "Sides");
}

// RISpec 3.2 appendix C.2, byte by byte.
TEST(Lexer, BinaryEncodings) {
    std::string s;
    const auto bytes = [&](std::initializer_list<int> b) {
        for (const int c : b)
            s += char(c);
    };
    bytes({0200, 5});                                     // 5
    bytes({0201, 0xff, 0xfe});                            // -2
    bytes({0204 + 1, 1, 0x80});                           // 1.5: two bytes, one behind the point
    bytes({0223, 'a', 'b', 'c'});                         // "abc"
    bytes({0240, 4, 'l', 'o', 'n', 'g'});                 // "long"
    bytes({0244, 0x3f, 0x80, 0, 0});                      // 1.0f
    bytes({0245, 0x3f, 0xf8, 0, 0, 0, 0, 0, 0});          // 1.5
    bytes({0314, 7, 0226, 'S', 'p', 'h', 'e', 'r', 'e'}); // request 7 = Sphere
    bytes({0246, 7});
    bytes({0315, 3, 0221, 'P'}); // string 3 = "P"
    bytes({0317, 3});
    bytes({0310, 2, 0x40, 0, 0, 0, 0xbf, 0x80, 0, 0}); // [2 -1]
    s += " Sides 2";
    Lexer l = lex(s);
    bool integer = false;
    EXPECT_EQ(l.peek(), Token::Number);
    EXPECT_EQ(l.number(&integer), 5);
    EXPECT_TRUE(integer);
    l.peek();
    EXPECT_EQ(l.number(), -2);
    l.peek();
    EXPECT_EQ(l.number(&integer), 1.5);
    EXPECT_FALSE(integer);
    EXPECT_EQ(l.peek(), Token::String);
    EXPECT_EQ(l.string(), "abc");
    l.peek();
    EXPECT_EQ(l.string(), "long");
    l.peek();
    EXPECT_EQ(l.number(), 1);
    l.peek();
    EXPECT_EQ(l.number(), 1.5);
    EXPECT_EQ(l.peek(), Token::Word);
    EXPECT_EQ(l.word(), "Sphere");
    EXPECT_EQ(l.peek(), Token::String);
    EXPECT_EQ(l.string(), "P");
    EXPECT_EQ(l.peek(), Token::Floats);
    std::vector<float> v;
    l.binary_floats(v);
    EXPECT_EQ(v, (std::vector<float>{2, -1}));
    EXPECT_EQ(l.peek(), Token::Word);
    EXPECT_EQ(l.word(), "Sides");
}

// A definition is no token: text after it is read as what it is, not as what the binary token before it was.
TEST(Lexer, TextAfterDefinitions) {
    Lexer lexer = lex("\223abc\315\007\221P Sphere \315\010\221Q \"text\"\315\011\221R 7");
    ASSERT_EQ(lexer.peek(), Token::String);
    EXPECT_EQ(lexer.string(), "abc");
    ASSERT_EQ(lexer.peek(), Token::Word);
    EXPECT_EQ(lexer.word(), "Sphere");
    ASSERT_EQ(lexer.peek(), Token::String);
    EXPECT_EQ(lexer.string(), "text");
    ASSERT_EQ(lexer.peek(), Token::Number);
    EXPECT_EQ(lexer.number(), 7);
    EXPECT_EQ(lexer.peek(), Token::End);
}

TEST(Lexer, CutBinaryIsBadNotRead) {
    for (const std::string& s :
         {std::string("\x81\x01"), std::string("\x9a"), std::string("\xa3\xff\xff\xff\xff"),
          std::string("\xcb\xff\xff\xff\xff\x01"), std::string("\xa4\x01"), std::string("\xa6\x01"),
          std::string("\xcf\x05"), std::string("\xcd\x01"), std::string("\xff")}) {
        Lexer l = lex(s);
        EXPECT_EQ(l.peek(), Token::Bad);
        l.skip();
        for (int i = 0; i < 8 && l.peek() != Token::End; i++)
            l.skip();
        EXPECT_EQ(l.peek(), Token::End);
    }
}

} // namespace kanuka::ingest
