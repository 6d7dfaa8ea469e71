// Cameras and options: what a text makes of the scene.
#include "ingest/rib/test_support.h"

namespace kanuka::ingest::test {

using scene::Camera;

TEST(RibCamera, IsWhatStandsBeforeTheWorld) {
    const Parsed r("Projection \"perspective\" \"fov\" [30]\nRotate 90 0 0 1\nTranslate 0 0 5\n"
                   "CoordinateSystem \"rig\"\nLightSource \"pointlight\" 1 \"from\" [1 2 3]\n"
                   "WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.camera.projection, Camera::Projection::Perspective);
    EXPECT_EQ(r.scene.camera.fov, 30);
    expect_point(r.scene.camera.camera_from_world.point({1, 0, 0}), 0, 1, 5);
    // Declared where the world is: nothing between them.
    ASSERT_EQ(r.scene.light_shaders.size(), 1u);
    expect_point(r.scene.light_shaders[0].world_from_shader.point({1, 2, 3}), 1, 2, 3);
    expect_point(r.scene.coordinate_systems.at("rig").point({1, 2, 3}), 1, 2, 3);
    expect_point(r.scene.coordinate_systems.at("camera").point({0, 1, 5}), 1, 0, 0);
}

TEST(RibCamera, LightOnTheCamera) {
    const Parsed r("Projection \"perspective\"\nLightSource \"spotlight\" \"lamp\"\nTranslate 0 0 5\n"
                   "WorldBegin Sphere 1 -1 1 360 WorldEnd");
    expect_point(r.scene.light_shaders.at(0).world_from_shader.point({0, 0, 0}), 0, 0, -5);
    EXPECT_EQ(r.scene.light_shaders[0].handle, "lamp");
}

TEST(RibCamera, DefaultsAndOptions) {
    const Parsed plain("WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_EQ(plain.scene.camera.projection, Camera::Projection::Orthographic);
    EXPECT_FALSE(plain.scene.camera.screen_window);

    const Parsed r(
        "Format 320 200 1.5 PixelSamples 3 2 PixelFilter \"catmull-rom\" 3 4 Exposure 2 2.2\n"
        "CropWindow 0.25 0.5 0 1 Clipping 0.1 100 DepthOfField 5.6 0.05 3 Shutter 0 0.5\n"
        "FrameAspectRatio 2 Projection \"orthographic\" Display \"a.exr\" \"openexr\" \"rgba\"\n"
        "Display \"b.exr\" \"openexr\" \"rgb\" Display \"+c.exr\" \"openexr\" \"z\" \"integer tile\" 5\n"
        "ShadingRate [0.5] Option \"limits\" \"bucketsize\" [16 16] Quantize \"rgba\" 255 0 255 0.5\n"
        "WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_SILENT(r);
    const scene::Options& o = r.scene.options;
    EXPECT_EQ(o.width, 320);
    EXPECT_EQ(o.height, 200);
    EXPECT_EQ(o.pixel_aspect, 1.5f);
    EXPECT_EQ(o.samples, 6);
    EXPECT_EQ(o.filter, "catmull-rom");
    EXPECT_EQ(o.filter_width[1], 4);
    EXPECT_EQ(o.exposure_gain, 2);
    EXPECT_EQ(o.crop, (std::array<float, 4>{0.25f, 0.5f, 0, 1}));
    EXPECT_EQ(o.shutter_close, 0.5f);
    ASSERT_EQ(o.displays.size(), 2u); // b replaced a, c was added
    EXPECT_EQ(o.displays[0].file, "b.exr");
    EXPECT_EQ(o.displays[1].file, "c.exr");
    EXPECT_EQ(o.displays[1].parameters.get_int("tile", 0), 5);
    EXPECT_EQ(r.scene.camera.near_clip, 0.1f);
    EXPECT_EQ(r.scene.camera.focal_distance, 3);
    EXPECT_EQ(*r.scene.camera.screen_window, (std::array<float, 4>{-2, 2, -1, 1}));
    EXPECT_EQ(r.primitive(0).attributes->shading_rate, 0.5f);
    EXPECT_EQ(o.user.find("limits:bucketsize")->ints[1], 16);
    EXPECT_EQ(o.user.find("quantize:rgba")->floats[2], 255);
}

TEST(RibOptions, Kanuka) {
    const Parsed r(
        "Option \"kanuka\" \"float geometrytolerance\" 0.5 \"normaltolerance\" [7] \"integer maxdepth\" 3 "
        "\"progressions\" [64] \"string integrator\" \"volpath\" \"seed\" 9 "
        "\"integer watertight\" 0 \"float instancelevels\" 2 "
        "\"integer instancevariants\" 16 \"integer uniqueupto\" 1000\n" +
        world("Sphere 1 -1 1 360"));
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.options.geometry_tolerance, 0.5f);
    EXPECT_EQ(r.scene.options.normal_tolerance, 7);
    EXPECT_EQ(r.scene.options.max_depth, 3);
    EXPECT_EQ(r.scene.options.samples, 64);
    EXPECT_FALSE(r.scene.options.watertight);
    EXPECT_EQ(r.scene.options.instance_levels, 2);
    EXPECT_EQ(r.scene.options.instance_variants, 16);
    EXPECT_EQ(r.scene.options.unique_up_to, 1000);
    EXPECT_EQ(r.scene.options.integrator, "volpath");
    EXPECT_EQ(r.scene.options.seed, 9u);
    const Parsed bad("Option \"kanuka\" \"float geometrytolerance\" -1 \"string integrater\" \"x\" \"string "
                     "maxdepth\" \"deep\"\n" +
                     world("Sphere 1 -1 1 360"));
    EXPECT_TRUE(bad.says("\"geometrytolerance\" must be a number of pixels"));
    EXPECT_TRUE(bad.says("there is no \"integrater\""));
    EXPECT_TRUE(bad.says("\"maxdepth\" must be"));
}

TEST(RibOptions, MadeTexturesStandForTheirPictures) {
    const Parsed r("MakeTexture \"a.tif\" \"a.tex\" \"periodic\" \"clamp\" \"gaussian\" 2 2\n" +
                   world("Sphere 1 -1 1 360"));
    EXPECT_EQ(r.scene.options.user.get_string("maketexture:a.tex", ""), "a.tif");
}

TEST(RibOptions, OutOfRangeStaysAsItWas) {
    const Parsed r(
        "Format 0 100 1\nPixelSamples 0 4\nPixelFilter \"hat\" 1 1\nCropWindow 0.5 0.2 0 1\nClipping 5 1\n"
        "DepthOfField -1 1 1\nExposure 1 0\nScreenWindow 1 1 0 1\nShadingRate -2\nFrameAspectRatio 0\n" +
        world("Sphere 1 -1 1 360"));
    EXPECT_EQ(r.messages(Severity::Error).size(), 10u) << r.all_messages();
    EXPECT_EQ(r.scene.options.width, 640);
    EXPECT_EQ(r.scene.options.filter, "gaussian");
    EXPECT_EQ(r.scene.camera.f_stop, 0);
    EXPECT_EQ(r.primitive(0).attributes->shading_rate, 1);
}

TEST(RibOptions, ColourSamplesOfParameters) {
    // Two samples: the first is red, the second blue.
    const Parsed p("ColorSamples [1 0 0  0 0 1] [1 0  0 0  0 1]\n" +
                   world("Color [.5 .25] LightSource \"pointlight\" 1 \"lightcolor\" [1 .5]\n"
                         "Surface \"plastic\" \"specularcolor\" [.25 .5] \"color[2] ramp\" [1 0 0 1]\n"
                         "Polygon \"P\" [0 0 1 1 0 1 0 1 1] \"Cs\" [1 0 .5 .5 0 1]\n"
                         "Surface \"plastic\" \"specularcolor\" [1 1 1] Sphere 1 -1 1 360"));
    const auto floats = [](const scene::Value* v) {
        return v ? std::vector<float>(v->floats.begin(), v->floats.end()) : std::vector<float>();
    };
    using V = std::vector<float>;
    EXPECT_EQ(p.primitive(0).attributes->color, Rgb(.5f, 0, .25f));
    EXPECT_EQ(p.scene.light_shaders.at(0).parameters.get_color("lightcolor", Rgb(0)), Rgb(1, 0, .5f));
    const auto& surface = p.primitive(0).attributes->surface->parameters;
    EXPECT_EQ(floats(surface.find("specularcolor")), (V{.25f, 0, .5f}));
    EXPECT_EQ(floats(surface.find("ramp")), (V{1, 0, 0, 0, 0, 1}));
    EXPECT_EQ(floats(p.primitive(0).primvars.find("Cs")), (V{1, 0, 0, .5f, 0, .5f, 0, 0, 1}));
    EXPECT_FALSE(p.primitive(1).attributes->surface->parameters.find("specularcolor"));
    EXPECT_TRUE(p.says("colors have 2 numbers since ColorSamples, found 3")) << p.all_messages();
    EXPECT_EQ(p.messages().size(), 1u) << p.all_messages();
}

TEST(RibOptions, ProjectionsAndLenses) {
    const Parsed r(
        "Projection \"fisheye\" DepthOfField 2 1 5 Hider \"raytrace\" \"float[4] aperture\" [6 30 0 0] "
        "\"float dofaspect\" 0.5 WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_SILENT(r);
    EXPECT_EQ(r.scene.camera.projection, Projection::Fisheye);
    EXPECT_EQ(r.scene.camera.fov, 180);
    EXPECT_EQ(r.scene.camera.blades, 6);
    EXPECT_EQ(r.scene.camera.blade_rotation, 30);
    EXPECT_EQ(r.scene.camera.squeeze, 2);
    const Parsed wide("Projection \"equisolid\" \"fov\" [300] Projection \"cube\" Option \"camera\" "
                      "\"float[2] shutteropening\" [0.8 0.2] WorldBegin Sphere 1 -1 1 360 WorldEnd");
    EXPECT_EQ(wide.scene.camera.fov, 300);
    EXPECT_TRUE(wide.says("there are perspective, orthographic, fisheye, equisolid, spherical"));
    EXPECT_TRUE(wide.says("must be open before it closes"));
    EXPECT_TRUE(wide.scene.options.shutter_opening.empty());
}

// PRMan and BMRT count the rays that go on, Kanuka the surfaces.
TEST(RibOptions, DepthOfRays) {
    EXPECT_EQ(Parsed("Option \"trace\" \"int maxdepth\" [0]\n" + world("")).scene.options.max_depth, 1);
    EXPECT_EQ(Parsed("Option \"trace\" \"maxdepth\" [4]\n" + world("")).scene.options.max_depth, 5);
    EXPECT_EQ(Parsed("Option \"render\" \"integer max_raylevel\" [4]\n" + world("")).scene.options.max_depth,
              5);
    const Parsed bad("Option \"trace\" \"int maxdepth\" [-1]\n" + world(""));
    EXPECT_EQ(bad.scene.options.max_depth, scene::Options{}.max_depth);
    EXPECT_TRUE(bad.says("must be a whole number of 0 or more")) << bad.all_messages();
}

} // namespace kanuka::ingest::test
