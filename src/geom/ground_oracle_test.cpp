// Ground of Blobbies: heights over files of depths, and their bounds.
#include <cmath>
#include <cstring>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "geom/ground_map.h"

namespace kanuka::geom {
namespace {

// A file of depths, and what it says, in double.
struct Ground {
    int width, height;
    double screen[4][4], camera[4][4]; // row vectors
    std::vector<float> depths;

    explicit Ground(int w, int h, uint32_t seed) : width(w), height(h) {
        std::mt19937 random(seed);
        for (int i = 0; i < w * h; i++)
            depths.push_back(5 + float(random() % 1000) / 400);
        const double c = std::cos(0.3), s = std::sin(0.3), f = 1.3;
        // World to camera: turned about z, moved along it; then to the screen, in perspective.
        const double to_camera[4][4] = {{c, s, 0, 0}, {-s, c, 0, 0}, {0, 0, 1, 0}, {0.1, -0.2, 0.5, 1}};
        const double project[4][4] = {{f, 0, 0, 0}, {0, 1.1 * f, 0, 0}, {0, 0, 1, 1}, {0, 0, -0.1, 0}};
        for (size_t r = 0; r < 4; r++)
            for (size_t k = 0; k < 4; k++) {
                camera[r][k] = double(float(to_camera[r][k]));
                double sum = 0;
                for (size_t i = 0; i < 4; i++)
                    sum += to_camera[r][i] * project[i][k];
                screen[r][k] = double(float(sum));
            }
    }
    void write(const std::string& path, bool turned) const {
        std::string bytes;
        const auto put = [&](auto v) {
            char b[sizeof v];
            std::memcpy(b, &v, sizeof v);
            if (turned)
                std::reverse(b, b + sizeof v);
            bytes.append(b, sizeof v);
        };
        put(uint32_t(0x2F0867AB)), put(uint16_t(width)), put(uint16_t(height));
        for (const auto& m : {screen, camera})
            for (size_t r = 0; r < 4; r++)
                for (size_t k = 0; k < 4; k++)
                    put(float(m[r][k]));
        for (const float z : depths)
            put(z);
        std::ofstream(path, std::ios::binary) << bytes;
    }
    static double column(const double (&m)[4][4], size_t k, const double* p) {
        return p[0] * m[0][k] + p[1] * m[1][k] + p[2] * m[2][k] + m[3][k];
    }
    bool raster(const double* p, double& x, double& y) const {
        const double w = column(screen, 3, p);
        x = (column(screen, 0, p) / w + 1) / 2 * width, y = (1 - column(screen, 1, p) / w) / 2 * height;
        return w > 0 && x >= 0 && y >= 0 && x <= width && y <= height;
    }
    double depth(double x, double y) const { // texels hold at their middles, between which is what is linear
        double sum = 0;
        for (int j = 0; j < height; j++)
            for (int i = 0; i < width; i++) {
                const double mx = std::min(std::max(x, 0.5), width - 0.5),
                             my = std::min(std::max(y, 0.5), height - 0.5);
                sum += std::max(0.0, 1 - std::abs(mx - i - 0.5)) * std::max(0.0, 1 - std::abs(my - j - 0.5)) *
                       double(depths[size_t(j * width + i)]);
            }
        return sum;
    }
    double z(const double* p) const { return column(camera, 2, p); }
};

} // namespace

// Heights over a file of depths, in either byte order and of any shape; bounds over boxes hold, and are those
// of texels at most as far away as the box is wide.
// Depths that are no finite numbers are no ground, wherever they are looked up: 0 times infinity is no
// number.
TEST(GroundOracles, DepthsThatAreNotFiniteAreNone) {
    const std::string path = ::testing::TempDir() + "kanuka_no_ground.z";
    for (const float z : {-INFINITY, INFINITY, NAN}) {
        Ground ground(1, 1, 3);
        ground.depths[0] = z;
        ground.write(path, false);
        std::string why;
        const auto map = GroundMap::read(path, why);
        ASSERT_TRUE(map) << why;
        const double p[3] = {0, 0, 5};
        EXPECT_GE(map->height(p), 0.99 * GroundMap::Nothing) << z;
    }
}

TEST(GroundOracles, HeightsAndTheirBounds) {
    std::mt19937 engine(7);
    const auto uniform = [&](double lo, double hi) {
        return lo + (hi - lo) * double(engine()) / 4294967296.0;
    };
    const std::string path = ::testing::TempDir() + "kanuka_ground.z";
    for (const auto& [w, h] : {std::pair{37, 23}, {1, 9}, {16, 1}, {1, 1}, {2, 2}})
        for (const bool turned : {false, true}) {
            const Ground ground(w, h, uint32_t(w));
            ground.write(path, turned);
            std::string why;
            const auto map = GroundMap::read(path, why);
            ASSERT_TRUE(map) << why;
            int inside = 0, narrow = 0;
            for (int i = 0; i < 3000; i++) {
                const double p[3] = {uniform(-6, 6), uniform(-6, 6), uniform(-1, 8)};
                double x, y;
                if (!ground.raster(p, x, y)) {
                    EXPECT_GE(map->height(p), GroundMap::Nothing);
                    continue;
                }
                inside++;
                EXPECT_NEAR(map->height(p), ground.depth(x, y) - ground.z(p), 1e-6);
                if (i % 4)
                    continue;
                // A parallelepiped about it.
                const double size = uniform(0.01, 1.5);
                double edge[3][3], corners[8][3];
                for (auto& e : edge)
                    for (double& c : e)
                        c = uniform(-size, size);
                double lo[2] = {1e30, 1e30}, hi[2] = {-1e30, -1e30}, near = 1e30, far = -1e30;
                bool within = true;
                for (int k = 0; k < 8; k++) {
                    for (int c = 0; c < 3; c++)
                        corners[k][c] = p[c] + (k & 1 ? edge[0][c] : 0) + (k & 2 ? edge[1][c] : 0) +
                                        (k & 4 ? edge[2][c] : 0);
                    double q[2];
                    within &= ground.raster(corners[k], q[0], q[1]);
                    for (int c = 0; c < 2; c++)
                        lo[c] = std::min(lo[c], q[c]), hi[c] = std::max(hi[c], q[c]);
                    near = std::min(near, ground.z(corners[k])), far = std::max(far, ground.z(corners[k]));
                }
                const GroundMap::Range bounds = map->heights(corners);
                for (int k = 0; k < 20; k++) {
                    const double a = uniform(0, 1), b = uniform(0, 1), t = uniform(0, 1);
                    double q[3];
                    for (int c = 0; c < 3; c++)
                        q[c] = p[c] + a * edge[0][c] + b * edge[1][c] + t * edge[2][c];
                    const double height = map->height(q);
                    EXPECT_GE(height, bounds.lo - 1e-6);
                    EXPECT_LE(height, bounds.hi + 1e-6);
                }
                if (!within) // beside the picture there is no ground: no upper bound
                    continue;
                const double reach = std::max(hi[0] - lo[0], hi[1] - lo[1]) + 2;
                double least = 1e30, most = -1e30;
                for (int b = 0; b < h; b++)
                    for (int a = 0; a < w; a++)
                        if (a + 1 >= lo[0] - reach && a <= hi[0] + reach && b + 1 >= lo[1] - reach &&
                            b <= hi[1] + reach) {
                            least = std::min(least, double(ground.depths[size_t(b * w + a)]));
                            most = std::max(most, double(ground.depths[size_t(b * w + a)]));
                        }
                EXPECT_GE(bounds.lo, least - far - 1e-6);
                EXPECT_LE(bounds.hi, most - near + 1e-6);
                narrow++;
            }
            EXPECT_GT(inside, 300);
            EXPECT_GT(narrow, 20);
            // Short of its last byte it is no map.
            std::ifstream whole(path, std::ios::binary);
            std::string bytes((std::istreambuf_iterator<char>(whole)), {});
            bytes.pop_back();
            std::ofstream(path, std::ios::binary) << bytes;
            EXPECT_FALSE(GroundMap::read(path, why));
        }
    std::remove(path.c_str());
}

} // namespace kanuka::geom
