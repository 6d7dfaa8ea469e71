// Rays that start at lights: places and directions against their densities, power against closed forms, and
// what light tracing finds on a floor against next-event estimation.
#include <functional>
#include <gtest/gtest.h>
#include <random>

#include "base/test_statistics.h"
#include "transport/light_emission.h"
#include "transport/test_floor.h"

namespace kanuka::transport {
namespace {

using namespace testing;
using Kind = scene::Light::Kind;
constexpr double Pi2 = 6.283185307179586;

// Rays of all lights of a scene, one by one.
class Rays {
  public:
    using F = Float<8>;
    TestScene& s;
    EmissionLights lights;

    explicit Rays(TestScene& s) : Rays(s, s.bvh->bounds()) {}
    Rays(TestScene& s, const Bounds3f& bounds) : s(s), lights(s.view, bounds) {}

    struct Ray {
        Vec3f P, N, d;
        double pdf_area, pdf_solid_angle;
        double
            carries; // of light that is 1 at all wavelengths, over the densities and the chance of the light
        int light;
    };
    // light < 0: any, by its chance.
    void each(int light, int count, const std::function<void(const Ray&)>& visit) {
        std::uniform_real_distribution<float> u(0, 0.99999994f);
        const F l[Wavelengths] = {F(0.2f), F(0.4f), F(0.5f), F(0.7f)};
        const float white = emission_spectrum(s.view, F(0.0f), F(0.0f), F(1e4f), F(1.0f), l)[0][0];
        for (int i = 0; i < count; i += 8) {
            F number[5];
            for (F& x : number)
                for (int k = 0; k < 8; k++)
                    x.v[k] = u(m_random);
            const Int<8> which = light < 0 ? lights.choose(number[4]) : Int<8>(light);
            const auto sample = sample_emission(s.view, lights, which, number[0], number[1], number[2],
                                                number[3], Mask<8>(true));
            const F carries = emitted(s.view, lights, sample, l)[0] * sample.cosine /
                              (sample.pdf_area * sample.pdf_solid_angle);
            const F chance = light < 0 ? lights.chance(which) : F(1.0f);
            for (int k = 0; k < 8; k++) {
                ASSERT_TRUE(sample.valid[k]) << which[k];
                const auto v = [&](const Vec3<F>& a) { return Vec3f(a.x[k], a.y[k], a.z[k]); };
                visit({v(sample.P), v(sample.N), v(sample.d), double(sample.pdf_area[k]),
                       double(sample.pdf_solid_angle[k]), double(carries[k] / (chance[k] * white)),
                       which[k]});
            }
        }
    }

  private:
    std::mt19937 m_random{7};
};

scene::Light light_of(Kind kind) {
    scene::Light light;
    light.kind = kind;
    light.world_from_light = Transform::translate(0.2, 0.1, 0.3) * Transform::rotate(50, 1, 2, 0.5);
    light.radius = 0;
    return light;
}

struct Case {
    const char* name;
    scene::Light light;
    double area;                                       // of its surface; 0: a point, or far
    std::function<std::array<double, 2>(Vec3f)> place; // in its space, even over the unit square
    double power;                                      // of amount 1; R2: of far lights, per pi R^2
    double solid_angle;                                // that is sampled evenly; 0: by the cosine
};

double turn(double y, double x) {
    const double t = std::atan2(y, x) / Pi2;
    return t < 0 ? t + 1 : t;
}

// A smooth edge inside the cone and a power of the cosine, as RISpec's spotlight has them: by quadrature.
double power_of_spot(double outer, double inner, int exponent) {
    double sum = 0;
    constexpr int N = 200000;
    for (int i = 0; i < N; i++) {
        const double c = outer + (1 - outer) * (i + 0.5) / N;
        const double t = std::clamp((c - outer) / (inner - outer), 0.0, 1.0);
        sum += t * t * (3 - 2 * t) * std::pow(c, exponent) * (1 - outer) / N;
    }
    return Pi2 * sum;
}

std::vector<Case> cases() {
    std::vector<Case> all;
    scene::Light quad = light_of(Kind::Quad);
    quad.width = 1.2f, quad.height = 0.7f;
    all.push_back({"quad", quad, 1.2 * 0.7,
                   [](Vec3f p) { return std::array{p.x / 1.2 + 0.5, p.y / 0.7 + 0.5}; }, Pi2 / 2 * 1.2 * 0.7,
                   0});
    scene::Light disk = light_of(Kind::Disk);
    disk.radius = 0.6f;
    const double disk_area = Pi2 / 2 * 0.36;
    all.push_back({"disk", disk, disk_area,
                   [](Vec3f p) {
                       return std::array{double(p.x * p.x + p.y * p.y) / 0.36,
                                         turn(double(p.y), double(p.x))};
                   },
                   Pi2 / 2 * disk_area, 0});
    scene::Light sphere = light_of(Kind::Sphere);
    sphere.radius = 0.5f;
    all.push_back({"sphere", sphere, Pi2 / 2,
                   [](Vec3f p) { return std::array{double(p.z) + 0.5, turn(double(p.y), double(p.x))}; },
                   Pi2 * Pi2 / 4, 0});
    scene::Light tube = light_of(Kind::Cylinder);
    tube.radius = 0.2f, tube.height = 1.5f;
    all.push_back(
        {"cylinder", tube, Pi2 * 0.2 * 1.5,
         [](Vec3f p) { return std::array{double(p.z) / 1.5 + 0.5, turn(double(p.y), double(p.x))}; },
         Pi2 / 2 * Pi2 * 0.2 * 1.5, 0});
    all.push_back({"point", light_of(Kind::Point), 0, nullptr, 2 * Pi2, 2 * Pi2});
    scene::Light spot = light_of(Kind::Spot);
    spot.cone_angle = 40, spot.cone_delta_angle = 10, spot.beam_distribution = 3;
    const double outer = std::cos(40 * Pi2 / 360), inner = std::cos(30 * Pi2 / 360);
    all.push_back({"spot", spot, 0, nullptr, power_of_spot(outer, inner, 3), Pi2 * (1 - outer)});
    all.push_back({"distant", light_of(Kind::Distant), 0, nullptr, 1, 0});
    scene::Light sun = light_of(Kind::Distant);
    sun.angle = 8;
    const double a = 4 * Pi2 / 360, cone = Pi2 * (1 - std::cos(a));
    all.push_back({"sun", sun, 0, nullptr, cone / (Pi2 / 2 * std::sin(a) * std::sin(a)), cone});
    all.push_back({"sky", constant_sky(Rgb(1)), 0, nullptr, 2 * Pi2, 2 * Pi2});
    return all;
}

bool is_far(const scene::Light& light) {
    return light.kind == Kind::Distant || light.kind == Kind::Environment;
}

struct LitFloor : FloorScene {
    explicit LitFloor(const std::vector<scene::Light>& lights) {
        inputs.lights = lights;
        finish();
    }
};

// The number of a scene's only light.
int number_of(const Rays& rays, const scene::Light& light) {
    return light.kind == Kind::Environment ? rays.lights.constant() : 0;
}

// Counts over cells of the unit square that are alike.
class Evenly {
  public:
    void add(double x, double y) {
        const auto cell = [](double v) { return std::clamp(int(v * Cells), 0, Cells - 1); };
        m_seen[size_t(cell(x) * Cells + cell(y))]++;
        m_count++;
    }
    double p() const {
        double statistic = 0;
        const double expected = m_count / double(m_seen.size());
        for (const double seen : m_seen)
            statistic += (seen - expected) * (seen - expected) / expected;
        return kanuka::testing::chi_square_p(statistic, int(m_seen.size()) - 1);
    }

  private:
    static constexpr int Cells = 12;
    std::vector<double> m_seen = std::vector<double>(size_t(Cells * Cells));
    double m_count = 0;
};

// Any frame about an axis.
std::array<Vec3f, 2> across(const Vec3f& axis) {
    const Vec3f x = normalize(cross(axis, std::abs(axis.x) < 0.7f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0)));
    return {x, cross(axis, x)};
}

constexpr int N = 200000;

} // namespace

TEST(LightEmission, PlacesAndDirectionsFollowTheirDensities) {
    for (const Case& c : cases()) {
        LitFloor scene({c.light});
        Rays rays(scene);
        const Transform light_from_world = c.light.world_from_light.inverse();
        const Vec3f axis = normalize(c.light.world_from_light.vector({0, 0, 1}));
        const double R = double(rays.lights.radius());
        Evenly places, directions;
        rays.each(number_of(rays, c.light), N, [&](const Rays::Ray& r) {
            if (c.place) {
                const auto [x, y] = c.place(light_from_world.point(r.P));
                places.add(x, y);
                EXPECT_NEAR(r.pdf_area * c.area, 1, 1e-4) << c.name;
            } else if (is_far(c.light)) { // the disk across the direction, behind the scene
                const Vec3f off = r.P - rays.lights.center();
                const auto [x, y] = across(r.d);
                const double u = double(dot(off, x)), v = double(dot(off, y));
                places.add((u * u + v * v) / (R * R), turn(v, u));
                EXPECT_NEAR(double(dot(off, r.d)), -R, 1e-4 * R) << c.name;
                EXPECT_NEAR(r.pdf_area * Pi2 / 2 * R * R, 1, 1e-4) << c.name;
            } else {
                EXPECT_EQ(r.pdf_area, 1) << c.name;
            }
            if (c.area > 0) { // by the cosine: its square is even
                const double cosine = double(dot(r.N, r.d));
                const auto [x, y] = across(r.N);
                directions.add(cosine * cosine, turn(double(dot(r.d, y)), double(dot(r.d, x))));
                EXPECT_NEAR(r.pdf_solid_angle, cosine * 2 / Pi2, 1e-4) << c.name;
            } else if (c.solid_angle > 0) {
                const Vec3f about = c.light.kind == Kind::Environment ? Vec3f(0, 0, 1) : axis;
                const auto [x, y] = across(about);
                const Vec3f off = r.d - about;
                directions.add(double(dot(off, off)) * 0.5 * Pi2 / c.solid_angle,
                               turn(double(dot(r.d, y)), double(dot(r.d, x))));
                EXPECT_NEAR(r.pdf_solid_angle * c.solid_angle, 1, 1e-3) << c.name;
            } else {
                EXPECT_LT(length(r.d - axis), 1e-5f) << c.name;
            }
        });
        if (c.place || is_far(c.light)) {
            EXPECT_GT(places.p(), 1e-4) << c.name;
        }
        if (c.area > 0 || c.solid_angle > 0) {
            EXPECT_GT(directions.p(), 1e-4) << c.name;
        }
    }
}

TEST(LightEmission, PowerIsThatOfTheLight) {
    for (const Case& c : cases()) {
        LitFloor scene({c.light});
        Rays rays(scene);
        const double R = double(rays.lights.radius());
        kanuka::testing::RunningMean power;
        rays.each(-1, N, [&](const Rays::Ray& r) {
            power.add(r.carries);
            EXPECT_EQ(r.light, number_of(rays, c.light)) << c.name;
        });
        const double expected = c.power * (is_far(c.light) ? Pi2 / 2 * R * R : 1);
        EXPECT_NEAR(power.mean(), expected, 2e-3 * expected + 4.5 * power.error()) << c.name;
        EXPECT_LT(power.error(), 0.01 * expected) << c.name;
    }
}

// Triangles of two sizes, and an instance of one: chosen by power, lit on one side.
TEST(LightEmission, Triangles) {
    TestScene s;
    s.add_quad({0, -1, 0}, {0, 0, 4}, {4, 0, 0}, {matte(Rgb(0.5f))});
    s.add_quad({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {emission(Rgb(1))}); // shines down; its area is 4
    s.add_quad({0, 0, 0}, {0.25f, 0, 0}, {0, 0, 0.25f},
               {emission(Rgb(2))}); // placed: twice as large, up there
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, 4, 4);
    s.finish(2, Transform::translate(0, 3, 0) * Transform::scale(2, 2, 2));
    Rays rays(s);
    kanuka::testing::RunningMean power;
    Evenly places, directions;
    double high = 0;
    rays.each(-1, N, [&](const Rays::Ray& r) {
        power.add(r.carries);
        EXPECT_LT(length(r.N - Vec3f(0, -1, 0)), 1e-5f);
        const bool placed = r.P.y > 2;
        high += placed;
        EXPECT_NEAR(r.P.y, placed ? 3 : 1, 1e-5f);
        EXPECT_NEAR(r.pdf_area, placed ? 2.0 : 0.5, 1e-4); // of one of two triangles
        const float half = placed ? 0.5f : 1.0f;
        places.add(double(r.P.x / half) * 0.5 + 0.5, double(r.P.z / half) * 0.5 + 0.5);
        directions.add(double(r.d.y * r.d.y), turn(double(r.d.z), double(r.d.x)));
    });
    EXPECT_NEAR(power.mean(), Pi2 / 2 * (4 + 2), 5e-3 * 19 + 4.5 * power.error());
    EXPECT_NEAR(high / N, 1 / 3.0, 0.01);
    EXPECT_GT(places.p(), 1e-4);
    EXPECT_GT(directions.p(), 1e-4);
}

// A sky of a bright corner: the density over solid angle, cell by cell, and the integral of the radiance.
TEST(LightEmission, SkiesWithAPicture) {
    constexpr int Width = 8, Height = 4;
    FloorScene s;
    s.inputs.map = {Width, Height, std::vector<float>(size_t(3 * Width * Height), 0.5f)};
    for (size_t c = 0; c < 3; c++)
        s.inputs.map.rgb[3 * (1 * Width + 2) + c] = 20;
    scene::Light sky;
    sky.kind = Kind::Environment;
    sky.texture = "map";
    s.inputs.lights = {sky};
    s.finish();
    Rays rays(s);
    constexpr int Rows = 16, Columns = 32, Fine = 24;
    const auto cell = [](const Vec3f& d) { // of where light comes from
        return std::clamp(int(0.5 * (1 - double(-d.z)) * Rows), 0, Rows - 1) * Columns +
               std::clamp(int(turn(double(-d.y), double(-d.x)) * Columns), 0, Columns - 1);
    };
    std::vector<double> seen(Rows * Columns), expected(Rows * Columns);
    kanuka::testing::RunningMean power;
    rays.each(rays.lights.picture(), N, [&](const Rays::Ray& r) {
        seen[size_t(cell(r.d))]++;
        power.add(r.carries);
    });
    double all = 0, light = 0;
    const double part = 2 * Pi2 / (double(Rows) * Fine * Columns * Fine);
    const auto texel = [&](int i, int j) {
        return double(
            s.inputs.map.rgb[size_t(3 * (std::clamp(j, 0, Height - 1) * Width + (i + Width) % Width))]);
    };
    for (int row = 0; row < Rows * Fine; row++)
        for (int column = 0; column < Columns * Fine; column++) {
            const double z = 1 - 2 * (row + 0.5) / (Rows * Fine), r = std::sqrt(1 - z * z),
                         phi = Pi2 * (column + 0.5) / (Columns * Fine);
            const Vec3<Float<1>> d(Float<1>(float(-r * std::cos(phi))), Float<1>(float(-r * std::sin(phi))),
                                   Float<1>(float(-z)));
            const auto pdf =
                pdf_emission(s.view, rays.lights, Int<1>(rays.lights.picture()), d, d, Mask<1>(true));
            expected[size_t(row / Fine * Columns + column / Fine)] +=
                N * double(pdf.pdf_solid_angle[0]) * part;
            all += double(pdf.pdf_solid_angle[0]) * part;
            const double x = phi / Pi2 * Width - 0.5, y = std::acos(z) / (Pi2 / 2) * Height - 0.5;
            const int i = int(std::floor(x)), j = int(std::floor(y));
            const double fx = x - i, fy = y - j;
            light += part * ((texel(i, j) * (1 - fx) + texel(i + 1, j) * fx) * (1 - fy) +
                             (texel(i, j + 1) * (1 - fx) + texel(i + 1, j + 1) * fx) * fy);
        }
    EXPECT_NEAR(all, 1, 2e-3);
    double statistic = 0;
    for (size_t i = 0; i < seen.size(); i++) {
        const double slack = 0.005 * expected[i]; // of the quadrature
        statistic += (seen[i] - expected[i]) * (seen[i] - expected[i]) / (expected[i] + slack * slack);
    }
    EXPECT_GT(kanuka::testing::chi_square_p(statistic, int(seen.size()) - 1), 1e-4);
    const double R = double(rays.lights.radius()), flux = light * Pi2 / 2 * R * R;
    EXPECT_NEAR(power.mean(), flux, 5e-3 * flux + 4.5 * power.error());
}

// Light that falls on the floor, block by block of the picture: along rays from lights, and as path has it.
TEST(LightEmission, LightTracingFindsWhatLightSamplingFinds) {
    std::vector<scene::Light> lights;
    for (const Case& c : cases()) {
        scene::Light light = c.light;
        const bool aimed =
            light.kind != Kind::Sphere && light.kind != Kind::Point && light.kind != Kind::Cylinder;
        if (!is_far(light)) // over the floor, looking down
            light.world_from_light = Transform::translate(0.25 * double(lights.size()) - 0.6, 0.6, 0.2) *
                                     (aimed ? Transform::rotate(90, 1, 0, 0) : Transform());
        else if (light.kind == Kind::Distant)
            light.world_from_light = Transform::rotate(light.angle > 0 ? 60 : 110, 1, 0, 0);
        light.visible_camera = false;
        lights.push_back(light);
    }
    LitFloor s(lights);
    Bounds3f seen; // far lights need to cover no more
    for (const float x : {-0.8f, 0.8f})
        seen.extend(Vec3f(x, -1, x));
    Rays rays(s, seen);
    constexpr int Blocks = 4, M = 3000000;
    std::vector<double> traced(Blocks * Blocks), found(Blocks * Blocks);
    rays.each(-1, M, [&](const Rays::Ray& r) {
        const float t = (-1 - r.P.y) / r.d.y;
        if (!(t > 0) || r.d.y >= 0)
            return;
        const double x = double(r.P.x + r.d.x * t) / 0.8, z = double(r.P.z + r.d.z * t) / 0.8;
        if (std::abs(x) >= 1 || std::abs(z) >= 1)
            return;
        const int column = int((x + 1) * 0.5 * Blocks), row = int((1 - z) * 0.5 * Blocks);
        const double area = 1.6 * 1.6 / (Blocks * Blocks);
        traced[size_t(row * Blocks + column)] += r.carries / (M * area);
    });
    const auto pixels = s.render(1024, 8);
    EXPECT_EQ(s.nan_samples, 0u);
    std::vector<bool> kinds(size_t(rays.lights.constant()) + 1);
    rays.each(-1, 20000, [&](const Rays::Ray& r) { kinds[size_t(r.light)] = true; });
    for (size_t k = 0; k < kinds.size(); k++)
        EXPECT_EQ(bool(kinds[k]), int(k) != rays.lights.picture()) << k;
    constexpr int Wide = Size / Blocks;
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++)
            found[size_t(y / Wide * Blocks + x / Wide)] +=
                double(pixels[size_t(y * Size + x)].rgb[1]) * Pi2 / 2 / double(Reflectance) / (Wide * Wide);
    for (size_t i = 0; i < traced.size(); i++)
        EXPECT_NEAR(traced[i], found[i], 0.025 * found[i]) << i;
}

TEST(LightEmission, LanesAgreeAndNothingShinesWithoutLights) {
    std::vector<scene::Light> lights;
    for (const Case& c : cases())
        lights.push_back(c.light);
    LitFloor s(lights);
    const EmissionLights of(s.view, s.bvh->bounds());
    std::mt19937 g(3);
    std::uniform_real_distribution<float> u(0, 0.99999994f);
    for (int n = 0; n < 300; n++) {
        Float<16> number[5];
        for (auto& x : number)
            for (int k = 0; k < 16; k++)
                x.v[k] = u(g);
        const Int<16> light = of.choose(number[4]);
        const auto wide =
            sample_emission(s.view, of, light, number[0], number[1], number[2], number[3], Mask<16>(true));
        for (int k = 0; k < 16; k++) {
            const auto one =
                sample_emission(s.view, of, Int<1>(light[k]), Float<1>(number[0][k]), Float<1>(number[1][k]),
                                Float<1>(number[2][k]), Float<1>(number[3][k]), Mask<1>(true));
            for (int c = 0; c < 3; c++) {
                EXPECT_EQ(wide.P[c][k], one.P[c][0]) << light[k];
                EXPECT_EQ(wide.d[c][k], one.d[c][0]) << light[k];
            }
            EXPECT_EQ(wide.pdf_area[k], one.pdf_area[0]);
            EXPECT_EQ(wide.pdf_solid_angle[k], one.pdf_solid_angle[0]);
        }
    }
    LitFloor dark({});
    EXPECT_TRUE(EmissionLights(dark.view, dark.bvh->bounds()).empty());
}

} // namespace kanuka::transport
