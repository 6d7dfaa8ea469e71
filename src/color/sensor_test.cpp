#include "color/sensor.h"

#include <cmath>
#include <gtest/gtest.h>

#include "color/difference.h"
#include "color/palette.h"

namespace kanuka::color {
namespace {

Table times(const Table& a, const Table& b) {
    Table r;
    for (int i = 0; i < LambdaCount; i++)
        r[i] = a[i] * b[i];
    return r;
}

// A reflectance, and another that looks the same under the light to the 1931 observer: it differs by what is
// left of a ripple once its part along the three weights is taken out.
struct Pair {
    Table a, b;
};
Pair metamers(const Table& light) {
    Vector3 dot{};
    Matrix3 gram{};
    std::array<Table, 3> w{times(light, cie_x()), times(light, cie_y()), times(light, cie_z())};
    Table ripple;
    for (int i = 0; i < LambdaCount; i++)
        ripple[i] = std::sin(float(i) / 18);
    for (int c = 0; c < 3; c++) {
        dot[c] = integrate(ripple, w[c]);
        for (int k = 0; k < 3; k++)
            gram[c][k] = integrate(w[c], w[k]);
    }
    const Vector3 part = inverse(gram) * dot;
    Pair p;
    const auto c = uplift({0.35f, 0.3f, 0.25f});
    double largest = 0;
    Table black;
    for (int i = 0; i < LambdaCount; i++) {
        black[i] = float(ripple[i] - part[0] * w[0][i] - part[1] * w[1][i] - part[2] * w[2][i]);
        largest = std::max(largest, std::abs(double(black[i])));
    }
    for (int i = 0; i < LambdaCount; i++) {
        p.a[i] = uplift_eval(c, LambdaMin + float(i));
        p.b[i] = p.a[i] + float(0.2 / largest) * black[i];
        EXPECT_GE(p.b[i], 0);
        EXPECT_LE(p.b[i], 1);
    }
    return p;
}

double delta_e(const Table& a, const Table& b, const Table& light) {
    const Vector3 white = observe(light);
    return delta_e_2000(lab_from_xyz(observe(times(a, light)), white),
                        lab_from_xyz(observe(times(b, light)), white));
}

// A camera that is no observer: three bells.
SpectrumColumns bells() {
    SpectrumColumns c;
    c.columns.resize(3);
    for (int l = 380; l <= 720; l += 10) {
        const auto bell = [&](double at, double width) {
            return std::exp(-0.5 * std::pow((l - at) / width, 2));
        };
        c.nm.push_back(l);
        c.columns[0].push_back(0.8 * bell(600, 35));
        c.columns[1].push_back(bell(535, 40));
        c.columns[2].push_back(0.6 * bell(460, 28));
    }
    return c;
}

double spread(const Rgb& c) {
    return std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z});
}

} // namespace

TEST(Sensor, TheDefaultIsTheObserverAndItsMatrix) {
    const Sensor s = make_sensor(Observer::Cie1931, illuminant_d65(), Space::Rec709);
    EXPECT_EQ(s.output_from_sensor, rgb_from_xyz);
    const float norm = 1 / cie_y_integral();
    for (int i = 0; i < LambdaCount; i++)
        EXPECT_EQ(s.curves[0][i], cie_x()[i] * norm);
}

TEST(Sensor, WhiteIsWhiteForEveryObserverBalanceAndSpace) {
    for (const Observer o : {Observer::Cie1931, Observer::Cie1964})
        for (const char* light : {"D65", "A", "F11", "LED-B1", "blackbody:3200"})
            for (const Space space : {Space::Rec709, Space::Rec2020, Space::AcesCg, Space::Aces2065}) {
                const Table white = *find_illuminant(light);
                for (const Sensor& s :
                     {make_sensor(o, white, space), make_camera(bells(), "bells", white, space)}) {
                    const Rgb rgb = s.see(white);
                    EXPECT_NEAR(rgb.x, 1, 2e-5) << light;
                    EXPECT_LT(spread(rgb), 2e-5) << light;
                }
            }
    const Rgb xyz =
        make_sensor(Observer::Cie1931, *find_illuminant("A"), Space::Xyz).see(*find_illuminant("A"));
    EXPECT_NEAR(xyz.x, 1.09850, 1e-4); // CIE 15: 109.850, 100, 35.585
    EXPECT_NEAR(xyz.z, 0.35585, 1e-4);
}

TEST(Sensor, MetamersPartUnderAnotherLightAndForAnotherEye) {
    const Table d65 = illuminant_d65(), a = *find_illuminant("A"), f11 = *find_illuminant("F11");
    const Pair p = metamers(d65);
    const double under_d65 = delta_e(p.a, p.b, d65), under_a = delta_e(p.a, p.b, a),
                 under_f11 = delta_e(p.a, p.b, f11);
    EXPECT_LT(under_d65, 1e-3);
    EXPECT_GT(under_a, 1);
    EXPECT_GT(under_f11, 1);
    // The 10 degree observer, and a camera, see them differ under D65 already.
    const Sensor narrow = make_sensor(Observer::Cie1931, d65, Space::Rec709),
                 wide = make_sensor(Observer::Cie1964, d65, Space::Rec709),
                 camera = make_camera(bells(), "bells", d65, Space::Rec709);
    const auto differ = [&](const Sensor& s) {
        const Rgb x = s.see(times(p.a, d65)), y = s.see(times(p.b, d65));
        return std::max({std::abs(x.x - y.x), std::abs(x.y - y.y), std::abs(x.z - y.z)});
    };
    EXPECT_LT(differ(narrow), 1e-5);
    EXPECT_GT(differ(wide), 2e-3);
    EXPECT_GT(differ(camera), 2e-3);
}

TEST(Sensor, ACamerasMatrixBringsColoursNear) {
    for (const char* light : {"D65", "A", "F11"}) {
        const Table white = *find_illuminant(light);
        const Sensor s = make_camera(bells(), "bells", white, Space::Rec709);
        const Sensor eye = make_sensor(Observer::Cie1931, white, Space::Rec709);
        double mean = 0, largest = 0;
        const Vector3 w = white_xyz(Space::Rec709);
        for (const Table& r : default_training()) {
            const auto lab = [&](const Rgb& rgb) {
                return lab_from_xyz(xyz_from_space(Space::Rec709) * Vector3{rgb.x, rgb.y, rgb.z}, w);
            };
            const double e = delta_e_2000(lab(s.see(times(r, white))), lab(eye.see(times(r, white))));
            mean += e / double(default_training().size());
            largest = std::max(largest, e);
        }
        EXPECT_LT(mean, 2);
    }
    SpectrumColumns two = bells();
    two.columns.pop_back();
    EXPECT_THROW(make_camera(two, "two", illuminant_d65(), Space::Rec709), Error);
    SpectrumColumns alike = bells();
    alike.columns[1] = alike.columns[0];
    EXPECT_THROW(make_camera(alike, "alike", illuminant_d65(), Space::Rec709), Error);
    SpectrumColumns blind = bells();
    for (double& v : blind.columns[2])
        v = 0;
    EXPECT_THROW(make_camera(blind, "blind", illuminant_d65(), Space::Rec709), Error);
}

TEST(Palette, MeasuredSpectraTravelAsTheirRgb) {
    Palette palette;
    const Pair p = metamers(illuminant_d65());
    const Rgb a = palette.add_reflectance(p.a), b = palette.add_reflectance(p.b);
    EXPECT_FALSE(a == b);
    EXPECT_LT(std::abs(a.x - b.x), 3e-4f); // metamers under D65
    EXPECT_EQ(palette.add_reflectance(p.a), a);
    for (const float k : {1.0f, 0.5f, 0.173f, 3.7f}) {
        const auto ca = palette.reflectance(a * k, 1),
                   cb = palette.reflectance(b * (k * 0.3f) * (1 / 0.3f), 1);
        ASSERT_EQ(ca[1], Palette::TableMark);
        ASSERT_EQ(cb[1], Palette::TableMark);
        EXPECT_NE(ca[0], cb[0]);
        EXPECT_NEAR(ca[3], k, 1e-5f * k);
        const Table shone = palette.emitted(palette.emission(a * k, 2 * k));
        EXPECT_NEAR(shone[200], k * p.a[200] * illuminant_d65()[200], 1e-4);
    }
    // What is not a multiple is uplifted as ever.
    const Rgb other{0.2f, 0.5f, 0.1f};
    const auto c = palette.reflectance(other, 1);
    const auto plain = uplift(other);
    EXPECT_EQ(c, (Palette::Coefficients{plain[0], plain[1], plain[2], 1}));
    EXPECT_EQ(palette.reflectance(Rgb(0), 1), Palette{}.reflectance(Rgb(0), 1));
    EXPECT_NE(palette.reflectance(Rgb(0.5f), 1)[1], Palette::TableMark);
}

TEST(Palette, LightsKeepTheirSpectraAndFilters) {
    Palette palette;
    EXPECT_EQ(palette.add_light(illuminant_d65()), Rgb(1));
    for (const char* name : {"A", "F11", "blackbody:1200", "E", "LED-RGB1"}) {
        const Table light = *find_illuminant(name);
        const Rgb rgb = palette.add_light(light);
        EXPECT_GE(std::min({rgb.x, rgb.y, rgb.z}), 0) << name;
        const Table t = palette.emitted(palette.emission(rgb * 5, 10));
        for (int i = 0; i < LambdaCount; i++)
            EXPECT_NEAR(t[i], 5 * light[i], 1e-4 * (1 + 5 * light[i])) << name;
        const Rgb red{0.9f, 0.2f, 0.1f};
        const Table gel = palette.emitted(palette.emission(palette.add_light(light, red), 1));
        const auto c = uplift(red * (0.5f / 0.9f));
        EXPECT_NEAR(gel[300], light[300] * 1.8f * uplift_eval(c, 660), 1e-3) << name;
    }
    const Rgb both[2] = {palette.add_light(*find_illuminant("A")), Rgb(1)};
    const auto sum = palette.sum(both);
    ASSERT_TRUE(sum);
    const Table t = palette.emitted(*sum);
    EXPECT_NEAR(t[250], (*find_illuminant("A"))[250] + illuminant_d65()[250], 1e-4);
    EXPECT_FALSE(Palette{}.sum(std::span(both).last(1)));
    EXPECT_THROW(palette.add_named("no such", {}), Error);
    EXPECT_THROW(palette.add_named("nm: 400 40, 700 60", {}), Error); // percents
    EXPECT_NO_THROW(palette.add_named("nm: 400 0.4, 700 1.01", {}));
    EXPECT_EQ(palette.tables().size() % Palette::TableStride, 0u);
}

// Kernels read past a table's end, at 830 nm: its last entry is repeated, not the next table's first.
TEST(Palette, TablesEndInTheirLastEntry) {
    Palette palette;
    palette.add_light(*find_illuminant("A"));
    palette.add_light(*find_illuminant("blackbody:1200"));
    palette.add_light(*find_illuminant("E"));
    const auto all = palette.tables();
    constexpr size_t Stride = Palette::TableStride;
    ASSERT_GE(all.size(), 3 * Stride);
    size_t differ = 0;
    for (size_t k = 0; k < all.size() / Stride; k++)
        for (size_t i = LambdaCount; i < Stride; i++) {
            EXPECT_EQ(all[k * Stride + i], all[k * Stride + LambdaCount - 1]) << k << ' ' << i;
            differ += k > 0 && all[k * Stride] != all[(k - 1) * Stride + LambdaCount - 1];
        }
    EXPECT_GT(differ, 0u);
}

} // namespace kanuka::color
