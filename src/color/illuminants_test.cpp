#include "color/illuminants.h"

#include <cmath>
#include <gtest/gtest.h>

#include "color/daylight.h"
#include "color/photometry.h"

namespace kanuka::color {
namespace {

struct Published {
    const char* name;
    double x, y, tolerance;
};
void PrintTo(const Published& p, std::ostream* out) {
    *out << p.name;
}

} // namespace

// CIE 15:2018, tables 8.1 and 10.1 to 12: chromaticities for the 1931 observer. Theirs are sums over 5 nm,
// ours over 1 nm of the same table with straight lines between; lamps with lines differ by a few 1e-4.
class Illuminants : public testing::TestWithParam<Published> {};

TEST_P(Illuminants, HasThePublishedChromaticity) {
    const Published& p = GetParam();
    const auto table = find_illuminant(p.name);
    ASSERT_TRUE(table) << p.name;
    const Chromaticity c = chromaticity(*table);
    EXPECT_NEAR(c.x, p.x, p.tolerance) << p.name;
    EXPECT_NEAR(c.y, p.y, p.tolerance) << p.name;
    EXPECT_NEAR(observe(*table)[1], 1, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(
    Cie, Illuminants,
    testing::Values(Published{"A", 0.44758, 0.40745, 3e-5}, Published{"E", 0.33333, 0.33333, 1e-4},
                    Published{"D50", 0.34567, 0.35851, 6e-5}, Published{"D55", 0.33243, 0.34744, 6e-5},
                    Published{"D65", 0.31272, 0.32903, 6e-5}, Published{"D75", 0.29903, 0.31488, 6e-5},
                    Published{"D60", 0.32163, 0.33774, 2e-4}, Published{"F1", 0.3131, 0.3371, 3e-4},
                    Published{"F2", 0.3721, 0.3751, 3e-4}, Published{"F3", 0.4091, 0.3941, 3e-4},
                    Published{"F4", 0.4402, 0.4031, 3e-4}, Published{"F5", 0.3138, 0.3452, 3e-4},
                    Published{"F6", 0.3779, 0.3882, 3e-4}, Published{"F7", 0.3129, 0.3292, 3e-4},
                    Published{"F8", 0.3458, 0.3586, 3e-4}, Published{"F9", 0.3741, 0.3727, 3e-4},
                    Published{"F10", 0.3458, 0.3588, 3e-4}, Published{"F11", 0.3805, 0.3769, 3e-4},
                    Published{"F12", 0.4370, 0.4042, 3e-4}, Published{"LED-B1", 0.4560, 0.4078, 3e-4},
                    Published{"LED-B2", 0.4357, 0.4012, 3e-4}, Published{"LED-B3", 0.3756, 0.3723, 3e-4},
                    Published{"LED-B4", 0.3422, 0.3502, 3e-4}, Published{"LED-B5", 0.3118, 0.3236, 3e-4},
                    Published{"LED-BH1", 0.4474, 0.4066, 3e-4}, Published{"LED-RGB1", 0.4557, 0.4211, 3e-4},
                    Published{"LED-V1", 0.4548, 0.4044, 3e-4}, Published{"LED-V2", 0.3781, 0.3775, 3e-4}));

TEST(Illuminants, DaylightFollowsItsFormula) {
    for (const float t : {4000.0f, 5003.0f, 6504.0f, 7000.0f, 9300.0f, 15000.0f, 25000.0f}) {
        const DaylightMix mix = daylight_mix(t);
        const Chromaticity c = chromaticity(daylight(t));
        EXPECT_NEAR(c.x, mix.x, 2e-4) << t;
        EXPECT_NEAR(c.y, mix.y, 2e-4) << t;
    }
    // The table of D65 is the formula's, rounded.
    const Table formula = daylight(float(6500 * DaylightFromNominal));
    for (int i = 0; i < LambdaCount; i++)
        EXPECT_NEAR(formula[i], illuminant_d65()[i], 2e-3) << LambdaMin + i;
}

TEST(Illuminants, NamesAreForgiving) {
    EXPECT_EQ(*find_illuminant("f11"), *find_illuminant("FL11"));
    EXPECT_EQ(*find_illuminant("led-b3"), *find_illuminant("LED-B3"));
    EXPECT_EQ(*find_illuminant("D6500"), daylight(float(6500 * DaylightFromNominal)));
    EXPECT_EQ(*find_illuminant("blackbody:3200"), blackbody(3200));
    EXPECT_EQ(*find_illuminant("blackbody:3200K"), blackbody(3200));
    EXPECT_FALSE(find_illuminant("F13"));
    EXPECT_FALSE(find_illuminant("F1.5"));
    EXPECT_FALSE(find_illuminant("sunshine"));
    EXPECT_FALSE(find_illuminant("sun:5"));
    EXPECT_THROW(find_illuminant("daylight:3000"), Error);
    EXPECT_THROW(find_illuminant("D20"), Error);
    EXPECT_THROW(find_illuminant("blackbody:hot"), Error);
    EXPECT_THROW(find_illuminant("blackbody:nan"), Error);
    for (const std::string& name : illuminant_names())
        EXPECT_TRUE(find_illuminant(name)) << name;
}

TEST(Illuminants, ResolveSaysWhatThereIs) {
    const auto inline_one = resolve_spectrum("nm: 400 0.25, 700 0.75", {});
    EXPECT_FALSE(inline_one.illuminant);
    EXPECT_FLOAT_EQ(inline_one.table[550 - 360], 0.5f);
    EXPECT_FLOAT_EQ(inline_one.table[0], 0.25f); // held
    try {
        resolve_spectrum("nowhere.spd", {});
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("LED-B1"), std::string::npos) << e.what();
    }
    EXPECT_THROW(resolve_light("nm: 400 0, 700 0", {}), Error);
    EXPECT_NEAR(observe(resolve_light("nm: 400 0.25, 700 0.75", {}))[1], 1, 1e-6);
}

TEST(Photometry, EfficacyOfKnownLights) {
    // 555 nm: 683 lm/W. Sums of V over equal energy from 360 to 830 nm: 683 * 106.857 / 471.
    Table line{};
    line[555 - 360] = 1;
    EXPECT_NEAR(luminous_efficacy(line), 683, 1e-3);
    EXPECT_NEAR(luminous_efficacy(*find_illuminant("E")), 683 * 106.857 / 471, 0.01);
    // A bigger part of a cooler lamp's power lies in the red, where the eye sees little.
    EXPECT_LT(luminous_efficacy(blackbody(2856)), luminous_efficacy(blackbody(4000)));
    EXPECT_GT(luminous_efficacy(*find_illuminant("F11")), 300);
}

TEST(Photometry, UnitsOfLights) {
    constexpr double Pi = 3.14159265358979;
    const LightMeasure point{LightShape::Point}, area{LightShape::Area, 0, 0.5};
    EXPECT_NEAR(*photometric(800, Unit::Lumen, point, 0), 800 / (4 * Pi), 1e-9);
    EXPECT_NEAR(*photometric(10, Unit::Watt, point, 100), 1000 / (4 * Pi), 1e-9);
    EXPECT_EQ(*photometric(7, Unit::Candela, point, 0), 7);
    EXPECT_FALSE(photometric(1, Unit::Lux, point, 0));
    EXPECT_NEAR(*photometric(800, Unit::Lumen, area, 0), 800 / (Pi * 0.5), 1e-9);
    EXPECT_NEAR(*photometric(3, Unit::Lux, area, 0), 3 / Pi, 1e-9);
    EXPECT_EQ(*photometric(1e5, Unit::Lux, {LightShape::Distant}, 0), 1e5);
    EXPECT_FALSE(photometric(1, Unit::Nit, {LightShape::Distant}, 0));
    EXPECT_EQ(*photometric(2, Unit::None, area, 0), 2);
    EXPECT_EQ(find_unit("lm"), Unit::Lumen);
    EXPECT_FALSE(find_unit("horsepower"));
}

TEST(Photometry, ExposureIsTheSaturationBasedOne) {
    // "Sunny 16": f/16 at 1/100 s and ISO 100 is EV 14.64; the brightest luminance it holds is 1.2 * 2^EV.
    const Exposure sunny{16, 1 / 100.0, 100, 0};
    EXPECT_NEAR(sunny.ev100(), 14.644, 1e-3);
    EXPECT_NEAR(1 / sunny.factor(), 1.2 * std::exp2(sunny.ev100()), 1e-6 / sunny.factor());
    EXPECT_NEAR(Exposure({16, 1 / 100.0, 200, 0}).factor() / sunny.factor(), 2, 1e-12);
    EXPECT_NEAR(Exposure({8, 1 / 100.0, 100, 0}).factor() / sunny.factor(), 4, 1e-12);
    EXPECT_EQ(Exposure{}.factor(), 1);
    EXPECT_EQ(Exposure({0, 0, 100, -2}).factor(), 0.25);
    // Grey card, 18 %, under 100 000 lux of sun: L = 0.18 E / pi, 0.45 of the top at f/16, a correct
    // exposure.
    EXPECT_NEAR(0.18 * 1e5 / 3.14159265 * sunny.factor(), 0.1865, 1e-3);
}

} // namespace kanuka::color
