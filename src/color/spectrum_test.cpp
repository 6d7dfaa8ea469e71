#include "color/spectrum.h"

#include <gtest/gtest.h>

namespace kanuka::color {
namespace {

std::string message_of(const std::string& text) {
    try {
        parse_columns(text, "paint.csv");
    } catch (const Error& e) {
        return e.where().str() + ": " + e.what();
    }
    return "";
}

} // namespace

TEST(Spectrum, FormatsOfFiles) {
    for (const char* text :
         {"400 0.1\n500 0.2\n600 0.4\n", "# paint\nwavelength, reflectance\n400,0.1\n500,0.2\n600,.4",
          "nm\tvalue\r\n400\t0.1\r\n500\t0.2\r\n600\t0.4\r\n", "400;0.1\n500;0.2\n600;0.4 // end",
          "0.4 0.1\n0.5 2e-1\n0.6 0.4", "600 0.4\n400 +0.1\n500 0.2\n",
          "<IESTM2714><SpectralData wavelength=\"400\">0.1</SpectralData>"
          "<SpectralData wavelength=\"500\"> 0.2 </SpectralData>\n"
          "<SpectralData wavelength=\"600\">0.4</SpectralData></IESTM2714>"}) {
        const Spectrum s = parse_columns(text, "x").column(0);
        ASSERT_EQ(s.nm.size(), 3u) << text;
        EXPECT_NEAR(s.at(450), 0.15, 1e-9) << text;
        EXPECT_NEAR(s.at(600), 0.4, 1e-9);
        EXPECT_EQ(s.at(650), 0);
        EXPECT_NEAR(s.at(650, Spectrum::Ends::Hold), 0.4, 1e-9);
        EXPECT_NEAR(s.at(300, Spectrum::Ends::Hold), 0.1, 1e-9);
    }
    const SpectrumColumns camera = parse_columns("nm,r,g,b\n400,1,2,3\n500,4,5,6\n", "x");
    ASSERT_EQ(camera.columns.size(), 3u);
    EXPECT_EQ(camera.column(2).at(500), 6);
    EXPECT_EQ(parse_columns("500 -0.1", "x").column(0).table()[140], 0);
}

// All of both tables counts, from 360 to 830 nm, and once.
TEST(Spectrum, IntegralsHaveBothEnds) {
    Table one, rising;
    for (int i = 0; i < LambdaCount; i++)
        one[size_t(i)] = 1, rising[size_t(i)] = float(i + 1);
    EXPECT_EQ(integrate(one, one), 471);
    EXPECT_EQ(integrate(one, rising), 471 * 472 / 2);
    EXPECT_EQ(integrate(rising, rising), 471.0 * 472 * 943 / 6);
}

// A text may be a part of another: what is behind it is not looked at.
TEST(Spectrum, CommentsBeginInsideOfTheText) {
    const std::string_view whole = "400 1\n500 2 //";
    EXPECT_EQ(parse_columns(whole, "x").columns[0].size(), 2u);
    EXPECT_THROW(parse_columns(whole.substr(0, whole.size() - 1), "x"), Error);
}

TEST(Spectrum, ErrorsSayWhereAndWhat) {
    EXPECT_NE(message_of("400 0.1\nabc 3\n").find("paint.csv:2"), std::string::npos)
        << message_of("400 0.1\nabc 3\n");
    EXPECT_NE(message_of("400 0.1\n500 0.1 0.2\n").find("3 numbers, the ones before have 2"),
              std::string::npos);
    EXPECT_NE(message_of("400\n").find("without a value"), std::string::npos);
    EXPECT_NE(message_of("400 1\n400 2\n").find("twice"), std::string::npos);
    EXPECT_NE(message_of("").find("no numbers"), std::string::npos);
    EXPECT_NE(message_of("400 nan\n").find("finite"), std::string::npos);
    EXPECT_NE(message_of("<SpectralData wavelength=\"x\">1</SpectralData>").find("not a number"),
              std::string::npos);
    EXPECT_THROW(read_spectrum("/nowhere/at.all"), Error);
    std::string noise;
    for (int i = 0; i < 3000; i++) {
        noise += char("0123456789.,;\n<>\"=eE+-# nmSpectralData"[i * 7919 % 38]);
        try {
            parse_columns(noise, "noise");
        } catch (const Error&) {
        }
    }
}

} // namespace kanuka::color
