#include "render/budget.h"

#include <gtest/gtest.h>

#include "base/error.h"

using namespace kanuka;
using namespace kanuka::render;

TEST(Budget, PicturesThatCannotFitAreRefusedWithTheFigure) {
    constexpr uint64_t Gigabyte = 1000000000;
    EXPECT_NO_THROW(refuse_what_cannot_fit({0, 0, 1920, 1080}, 8, 1 * Gigabyte));
    EXPECT_NO_THROW(refuse_what_cannot_fit({29000, 29000, 30000, 30000}, 0, 1 * Gigabyte)); // a crop window
    try {
        refuse_what_cannot_fit({0, 0, 30000, 30000}, 0, 24 * Gigabyte);
        FAIL();
    } catch (const Error& e) {
        // 9e8 pixels: more than 9e8 times the 20 floats of a picture, less than four times that.
        const std::string what = e.what();
        const double figure = std::stod(what.substr(what.find("takes ") + 6));
        EXPECT_GT(figure, 72);
        EXPECT_LT(figure, 288);
        EXPECT_NE(what.find("30000 by 30000"), std::string::npos) << what;
        EXPECT_NE(what.find("there are 24.0 GB"), std::string::npos) << what;
    }
    EXPECT_GT(machine_memory(), Gigabyte / 4);
}

TEST(Budget, Threads) {
    EXPECT_NO_THROW(check_threads(0));
    EXPECT_NO_THROW(check_threads(4096));
    EXPECT_THROW(check_threads(-1), Error);
    EXPECT_THROW(check_threads(2000000000), Error);
}

TEST(Budget, Geometry) {
    EXPECT_NO_THROW(refuse_geometry_that_cannot_fit(1000, 3000));
    EXPECT_THROW(refuse_geometry_that_cannot_fit(2000, 3000), Error);
}
