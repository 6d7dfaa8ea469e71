// Techniques together give what each alone, or a quadrature, gives: glossy floors under lamps, dispersion in
// a ball, roulette, absorption.
#include <functional>
#include <gtest/gtest.h>

#include "transport/roulette.h"
#include "transport/test_scene.h"

namespace kanuka::transport {
namespace {

using namespace testing;

constexpr int Size = 20;

// ---- a glossy floor under a lamp

// Emits downwards, and back to where the floor mirrors it to the camera.
const Vec3f LampCenter(0.1f, 0.6f, 3.4f), LampX(0.25f, 0, 0), LampY(0, -0.1f, 0.2f);

// Floor at y = -1, seen from the origin at a slant, so that the lamp's mirror image is in the picture.
void add_glossy_floor(TestScene& s, const Lobe& lobe) {
    s.add_quad({0, -1, 0}, {0, 0, 8}, {8, 0, 0}, {lobe});
    s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, Size, Size);
    s.inputs.max_depth = 1;
}

void add_lamp(TestScene& s) {
    s.add_quad(LampCenter, LampX, LampY, {emission(Rgb(8))});
}

// Light from the lamp off the floor, at the middle of each pixel, by a sum over the lamp.
double quadrature(TestScene& s, bsdf::LobeInputs<1> in, grid::LobeId id) {
    const CameraView& c = s.inputs.camera;
    double total = 0;
    const Vec3f n = normalize(cross(LampX, LampY));
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            const Vec3f p = s.pixel_direction(x, y);
            Vec3f d;
            for (int r = 0; r < 3; r++)
                d[r] = c.render_from_camera[4 * r] * p.x + c.render_from_camera[4 * r + 1] * p.y +
                       c.render_from_camera[4 * r + 2];
            if (d.y >= 0)
                continue;
            const Vec3f hit = d * (-1 / d.y), v = normalize(-d);
            const Vec3<Float<1>> wo{Float<1>(v.x), Float<1>(v.z), Float<1>(v.y)};
            constexpr int N = 64;
            double sum = 0;
            for (int i = 0; i < N; i++)
                for (int j = 0; j < N; j++) {
                    const Vec3f to = LampCenter + LampX * ((float(i) + 0.5f) * 2 / N - 1) +
                                     LampY * ((float(j) + 0.5f) * 2 / N - 1) - hit;
                    const float d2 = dot(to, to);
                    const Vec3f w = to * (1 / std::sqrt(d2));
                    const Float<1> l[bsdf::Wavelengths] = {Float<1>(0.2f), Float<1>(0.4f), Float<1>(0.6f),
                                                           Float<1>(0.8f)};
                    bsdf::prepare_lobe(id, in, wo, Mask<1>(true), l);
                    const auto f =
                        bsdf::eval_lobe<1>(id, in, wo, {Float<1>(w.x), Float<1>(w.z), Float<1>(w.y)});
                    sum += 8 * double(f.f[0][0]) * std::max(0.0, double(-dot(w, n))) / double(d2);
                }
            total += sum * 4 * double(length(cross(LampX, LampY))) / (N * N);
        }
    return total / (Size * Size);
}

} // namespace

// Both techniques together, in an instance too, and directions alone (an instanced lamp that has no number is
// without next-event estimation), against the quadrature.
TEST(Mis, GlossyFloorUnderALamp) {
    for (float roughness : {0.25f, 0.45f, 0.8f}) {
        bsdf::LobeInputs<1> in;
        for (auto& color : in.color)
            color = bsdf::Spectrum<1>(Float<1>(1.0f));
        in.number[grid::number_of(grid::LobeId::MicrofacetConductorBrdf, "roughness")] = Float<1>(roughness);
        for (const auto& [instanced, next_event] : {std::pair(false, true), {true, true}, {true, false}}) {
            TestScene s;
            add_glossy_floor(s, metal(roughness));
            add_lamp(s);
            s.filter = {0, 0}; // rays through the middles of pixels, as the sum has it
            if (!next_event)
                s.most_slots = 0;
            s.finish(instanced ? 1 : -1);
            const double expected = quadrature(s, in, grid::LobeId::MicrofacetConductorBrdf);
            EXPECT_EQ(s.view.lights.emitter_choice >= 0, next_event);
            EXPECT_EQ(s.unnumbered, next_event ? 0u : 2u);
            const auto e = s.estimate(next_event ? 64 : 128, 12);
            for (const auto& c : e.channel) {
                EXPECT_NEAR(c.mean(), expected, 0.004 * expected + 4.5 * c.error())
                    << roughness << " " << instanced << next_event;
                EXPECT_LT(c.error(), 0.02 * expected);
            }
        }
    }
}

// Grooves run along dPdu, turned by `rotation`: a floor whose u is turned a quarter is one whose grooves are,
// and neither is the floor itself.
TEST(Mis, GroovesFollowTheSurface) {
    const auto floor = [](bool turned, float rotation) {
        TestScene s;
        const Lobe grooved{grid::LobeId::MicrofacetConductorBrdf,
                           {Rgb(1), Rgb(1), Vec3f(0.5f), Rgb(1), Vec3f(0.9f), Vec3f(rotation)}};
        const Vec3f x(8, 0, 0), z(0, 0, 8);
        s.add_quad({0, -1, 0}, turned ? x : z, turned ? -z : x, {grooved});
        add_lamp(s);
        s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, Size, Size);
        s.inputs.max_depth = 1;
        s.finish();
        return s.estimate(32, 8);
    };
    const auto plain = floor(false, 0), quarter = floor(false, 0.25f), turned = floor(true, 0),
               back = floor(true, 0.75f);
    for (int c = 0; c < 3; c++) {
        const double slack = 4.5 * std::hypot(plain.channel[c].error(), turned.channel[c].error());
        EXPECT_NEAR(quarter.channel[c].mean(), turned.channel[c].mean(), slack + 1e-4);
        EXPECT_NEAR(back.channel[c].mean(), plain.channel[c].mean(), slack + 1e-4);
        EXPECT_GT(std::abs(turned.channel[c].mean() - plain.channel[c].mean()), 2 * slack);
    }
}

// Of dPdu only what lies across the shading normal counts: a floor whose normals lean is the same with the
// rest of it and without, and another one where grooves run the other way.
TEST(Mis, GroovesLieAcrossLeaningNormals) {
    const auto floor = [](Vec3f dPdu) {
        grid::Grid g;
        g.allocate(1, 1);
        grid::TracedGrid t;
        t.mu = t.mv = 1;
        const Vec3f n = normalize(Vec3f(0.7f, 1, 0));
        for (size_t i = 0; i < 4; i++) {
            const Vec3f p(i % 2 ? 8.0f : -8.0f, -1, i / 2 ? -8.0f : 8.0f);
            for (int c = 0; c < 3; c++) {
                g.P[size_t(c * g.stride) + i] = p[c];
                g.N[size_t(c * g.stride) + i] = n[c];
                g.dPdu[size_t(c * g.stride) + i] = dPdu[c];
                t.P.push_back(p[c]);
            }
        }
        std::vector<Vec3f> values;
        const auto program = make_program({{grid::LobeId::MicrofacetConductorBrdf,
                                            {Rgb(1), Rgb(1), Vec3f(0.5f), Rgb(1), Vec3f(0.9f), Vec3f(0.0f)}}},
                                          values);
        grid::VertexInputs in;
        in.stride = g.stride;
        for (const Vec3f& v : values)
            in.slots.push_back({true, v, {}});
        TestScene s;
        s.add({&g, &t, nullptr, &in}, program);
        s.add_quad({0, 1, 2}, {0.3f, 0, 0}, {0, 0, 0.3f}, {emission(Rgb(8))});
        s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, Size, Size);
        s.inputs.max_depth = 1;
        s.finish();
        return s.estimate(32, 4).channel[1].mean();
    };
    const Vec3f n = normalize(Vec3f(0.7f, 1, 0)), x(1, 0, 0);
    const double whole = floor(x), across = floor(normalize(x - n * dot(n, x))),
                 other = floor(Vec3f(0, 0, 1));
    EXPECT_GT(whole, 0.01);
    EXPECT_NEAR(whole / across, 1, 1e-4);
    EXPECT_GT(std::abs(other / across - 1), 0.05);
}

// A lobe and the sum of its halves, a coat's lobe beside a matte one: the estimate of a mixture is that of
// its parts.
TEST(Mis, LobesAddUp) {
    const Lobe matte_half = matte(Rgb(0.8f), 0.5f);
    Lobe gloss = metal(0.3f);
    gloss.weight = 0.5f;
    double mean[3], error[3];
    const std::vector<Lobe> sets[] = {{matte_half}, {gloss}, {matte_half, gloss}};
    for (int k = 0; k < 3; k++) {
        TestScene s;
        s.add_quad({0, -1, 0}, {0, 0, 8}, {8, 0, 0}, sets[k]);
        s.camera({1, 0, 0}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}, 0.5f, Size, Size);
        s.inputs.max_depth = 1;
        add_lamp(s);
        s.inputs.lights.push_back(constant_sky(Rgb(0.2f)));
        s.inputs.lights.back().visible_camera = false;
        s.finish();
        const auto e = s.estimate(64, 12);
        mean[k] = e.channel[1].mean(), error[k] = e.channel[1].error();
    }
    EXPECT_NEAR(mean[2], mean[0] + mean[1], 0.002 * mean[2] + 4.5 * std::hypot(error[0], error[1], error[2]));
}

// ---- dispersion

namespace {

// A spot of light behind the ball, on a dim sky.
LatLong spot_sky(const Vec3f& at) {
    LatLong m{256, 128, {}};
    for (int j = 0; j < m.height; j++)
        for (int i = 0; i < m.width; i++) {
            const float t = Pi * (float(j) + 0.5f) / float(m.height),
                        p = 2 * Pi * (float(i) + 0.5f) / float(m.width);
            const Vec3f d(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t));
            const float l = 0.2f + 4 * std::exp(12 * (dot(d, at) - 1));
            m.rgb.insert(m.rgb.end(), {l, l, l});
        }
    return m;
}

struct Direction {
    double x, y, z;
};

// Light of one wavelength through a ball of index n about (0, 0, 3): reflection, and what leaves after each
// inner bounce, with Snell's and Fresnel's laws in the plane of incidence.
double through_ball(Direction d, double n, const std::function<double(const Direction&)>& sky) {
    const double length = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
    d = {d.x / length, d.y / length, d.z / length};
    const double b = 3 * d.z, discriminant = b * b - 8;
    const double t = b - std::sqrt(discriminant);
    const Direction N = {d.x * t, d.y * t, d.z * t - 3};
    const double cos_i = -(d.x * N.x + d.y * N.y + d.z * N.z), sin_i = std::sqrt(1 - cos_i * cos_i);
    const double sin_t = sin_i / n, cos_t = std::sqrt(1 - sin_t * sin_t);
    const double rs = (cos_i - n * cos_t) / (cos_i + n * cos_t),
                 rp = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    const double R = 0.5 * (rs * rs + rp * rp);
    // Each pass turns the ray by a known angle in the plane of d and N.
    const double ai = std::asin(sin_i), at = std::asin(sin_t);
    const Direction side = {(N.x + cos_i * d.x) / std::max(sin_i, 1e-12),
                            (N.y + cos_i * d.y) / std::max(sin_i, 1e-12),
                            (N.z + cos_i * d.z) / std::max(sin_i, 1e-12)};
    const auto turned = [&](double angle) { // towards -side: into the ball's axis
        const double c = std::cos(angle), s = std::sin(angle);
        return Direction{d.x * c - side.x * s, d.y * c - side.y * s, d.z * c - side.z * s};
    };
    double sum = R * sky(turned(-(3.141592653589793 - 2 * ai)));
    double weight = (1 - R) * (1 - R);
    for (int k = 0; k < 20; k++) { // k inner reflections: deviation 2 (ai - at) + k (pi - 2 at)
        sum += weight * sky(turned(2 * (ai - at) + k * (3.141592653589793 - 2 * at)));
        weight *= R;
    }
    return sum;
}

} // namespace

TEST(Dispersion, BallAgainstSnellWavelengthByWavelength) {
    const Vec3f at = normalize(Vec3f(-0.35f, 0.1f, 1));
    const float n_d = 1.5f, abbe = 8;
    for (float roughness :
         {0.0f, 0.034f}) { // smooth: one wavelength a path; just rough enough for all four together
        TestScene s;
        s.add_sphere({0, 0, 3}, 1, 192, {prism(roughness, n_d, abbe)});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.2f, Size, Size);
        s.inputs.map = spot_sky(at);
        scene::Light sky;
        sky.kind = scene::Light::Kind::Environment;
        sky.texture = "spot";
        s.inputs.lights.push_back(sky);
        s.inputs.max_depth = 24;
        s.finish();
        const auto e = s.estimate(64, 12);
        double xyz[3] = {0, 0, 0};
        const double B = (n_d - 1) / (abbe * (1 / (486.13 * 486.13) - 1 / (656.28 * 656.28)));
        for (int i = 0; i < color::LambdaCount; i += 5) {
            const double lambda = 360 + i, n = n_d + B * (1 / (lambda * lambda) - 1 / (587.56 * 587.56));
            double sum = 0;
            for (int y = 0; y < Size; y++)
                for (int x = 0; x < Size; x++) {
                    const Vec3f d = s.pixel_direction(x, y);
                    sum += through_ball({d.x, d.y, d.z}, n, [&](const Direction& w) {
                        return 0.2 + 4 * std::exp(12 * (w.x * double(at.x) + w.y * double(at.y) +
                                                        w.z * double(at.z) - 1));
                    });
                }
            sum *= 5.0 / (Size * Size) * color::illuminant_d65()[size_t(i)] / color::cie_y_integral();
            xyz[0] += sum * color::cie_x()[size_t(i)], xyz[1] += sum * color::cie_y()[size_t(i)],
                xyz[2] += sum * color::cie_z()[size_t(i)];
        }
        const Rgb expected = color::xyz_to_rgb({float(xyz[0]), float(xyz[1]), float(xyz[2])});
        EXPECT_GT(std::abs(expected.x - expected.z), 0.05 * expected.y); // there is colour to be right about
        for (int k = 0; k < 3; k++)
            EXPECT_NEAR(e.channel[k].mean(), expected[k], 0.01 * expected[k] + 4.5 * e.channel[k].error())
                << roughness << ", channel " << k;
    }
}

// An Abbe number so large that nothing bends apart takes all the roads of dispersion to the picture of plain
// glass.
TEST(Dispersion, NoneIsPlainGlass) {
    double mean[2][3], error[2][3];
    for (int k = 0; k < 2; k++) {
        TestScene s;
        s.add_quad({0, -1, 3}, {0, 0, 4}, {4, 0, 0}, {matte(Rgb(0.7f, 0.4f, 0.2f))});
        s.add_sphere({0, 0, 3}, 0.9f, 64, {k ? prism(0.2f, 1.5f, 1e6f) : glass(0.2f)});
        s.add_quad({0, 2, 3}, {0.5f, 0, 0}, {0, 0, 0.5f}, {emission(Rgb(10))});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.4f, Size, Size);
        s.inputs.lights.push_back(constant_sky(Rgb(0.5f)));
        s.inputs.max_depth = 16;
        s.finish();
        EXPECT_EQ(s.view.settings.keeps_ratios, k == 1);
        const auto e = s.estimate(64, 12);
        for (int c = 0; c < 3; c++)
            mean[k][c] = e.channel[c].mean(), error[k][c] = e.channel[c].error();
    }
    for (int c = 0; c < 3; c++)
        EXPECT_NEAR(mean[1][c], mean[0][c], 0.003 * mean[0][c] + 4.5 * std::hypot(error[0][c], error[1][c]));
}

// ---- roulette

TEST(Roulette, ChangesNoMean) {
    const auto room = [](int roulette_depth, const RouletteFactors* factors, bool dispersive) {
        TestScene s;
        const Vec3f x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
        const auto wall = [&](Vec3f p, Vec3f a, Vec3f b, const Rgb& c) { s.add_quad(p, a, b, {matte(c)}); };
        wall(-z, x, y, Rgb(0.9f)), wall(z, y, x, Rgb(0.7f)), wall(-x, y, z, Rgb(0.8f, 0.1f, 0.1f));
        wall(x, z, y, Rgb(0.1f, 0.7f, 0.1f)), wall(-y, z, x, Rgb(0.8f)), wall(y, x, z, Rgb(0.8f));
        s.add_quad({0, 0.95f, 0}, {0.3f, 0, 0}, {0, 0, 0.3f}, {emission(Rgb(5))});
        s.add_sphere({0.3f, -0.5f, 0.4f}, 0.4f, 24,
                     {dispersive ? prism(0.3f, 1.5f, 20) : metal(0.3f, Rgb(0.9f, 0.6f, 0.3f))});
        s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 1, Size, Size);
        s.inputs.max_depth = 24;
        s.finish();
        s.view.settings.roulette_depth = roulette_depth;
        s.view.settings.roulette = factors;
        return s.estimate(16, 10);
    };
    for (bool dispersive : {false, true}) {
        const RouletteFactors factors{{1.5f, 0.7f, 1, 3, 0.3f, 0.5f, 1, 2}};
        const auto always = room(1, nullptr, dispersive), never = room(1000, nullptr, dispersive),
                   learned = room(1000, &factors, dispersive);
        for (const auto& some : {always, learned})
            for (int c = 0; c < 3; c++)
                EXPECT_NEAR(some.channel[c].mean(), never.channel[c].mean(),
                            0.002 * never.channel[c].mean() +
                                4.5 * std::hypot(some.channel[c].error(), never.channel[c].error()));
    }
}

// ---- absorption

// Beer and Lambert through a slab of an index so near 1 that it neither bends nor reflects.
TEST(Absorption, Slab) {
    TestScene s;
    store::Interior ink;
    ink.absorbs = true;
    const auto grey = color::uplift(Rgb(0.5f));
    ink.absorption_spectrum = {grey[0], grey[1], grey[2], 2 * 0.7f}; // 0.7 / m
    const int interior = s.store.add_interior(ink);
    const Lobe clear = glass(0, 1.0001f);
    s.add_quad({0, 0, 1}, {0, 3, 0}, {3, 0, 0}, {clear}, interior);    // faces the camera
    s.add_quad({0, 0, 2.5f}, {3, 0, 0}, {0, 3, 0}, {clear}, interior); // faces away
    s.camera({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0.5f, Size, Size);
    s.inputs.lights.push_back(constant_sky(Rgb(2)));
    s.finish();
    const auto pixels = s.render(256, 8);
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++) {
            const double expected = 2 * std::exp(-0.7 * 1.5 * double(length(s.pixel_direction(x, y))));
            EXPECT_NEAR(pixels[size_t(y * Size + x)].rgb[1], expected, 0.05 * expected);
        }
    double expected = 0;
    for (int y = 0; y < Size; y++)
        for (int x = 0; x < Size; x++)
            expected += 2 * std::exp(-0.7 * 1.5 * double(length(s.pixel_direction(x, y)))) / (Size * Size);
    const auto e = s.estimate(32, 12);
    for (const auto& c : e.channel)
        EXPECT_NEAR(c.mean(), expected, 0.002 * expected + 4.5 * c.error());
}

} // namespace kanuka::transport
