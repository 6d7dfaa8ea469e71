#include "scene/picture_name.h"

#include <gtest/gtest.h>

namespace kanuka::scene {
namespace {

TEST(PictureName, SuffixesOfPicturesGoAndOthersStay) {
    EXPECT_EQ(picture_file("ball.tif"), "ball.exr");
    EXPECT_EQ(picture_file("a/b.c/ball.TIFF"), "a/b.c/ball.exr");
    EXPECT_EQ(picture_file("ball"), "ball.exr");
    EXPECT_EQ(picture_file("anim.0001"), "anim.0001.exr");
    EXPECT_EQ(picture_file("anim.0001.tif"), "anim.0001.exr");
    EXPECT_EQ(picture_file("env.xp"), "env.xp.exr");
    EXPECT_EQ(picture_file("shadows.z"), "shadows.z.exr");
    EXPECT_EQ(picture_file("ball.exr"), "ball.exr");
    EXPECT_EQ(picture_file("a.tif/ball"), "a.tif/ball.exr");
    EXPECT_EQ(picture_file(".tif"), ".tif.exr");
    EXPECT_EQ(picture_file("a."), "a..exr");
    EXPECT_EQ(picture_file(""), ".exr");
}

} // namespace
} // namespace kanuka::scene
