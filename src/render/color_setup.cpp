#include "render/color_setup.h"

#include <cmath>

#include "shade/search.h"

namespace kanuka::render {

namespace {

color::Space space_of(const std::string& name, bool scene_linear, color::Space instead, const Location& where,
                      Journal& journal) {
    if (name.empty())
        return instead;
    const auto space = color::find_space(name);
    if (space && (!scene_linear || color::info(*space).scene_linear))
        return *space;
    journal.error(where, "the colour space \"" + name + "\" is not one of " +
                             color::space_names(scene_linear) + "; " +
                             std::string(color::info(instead).name) + " stands in for it");
    return instead;
}

} // namespace

ColorSetup make_color_setup(const scene::Scene& scene, const scene::Options& options, Journal& journal) {
    const scene::ColorOptions& o = options.color;
    const Location where = o.where.file.empty() ? Location{scene.file} : o.where;
    ColorSetup setup;
    setup.folders = shade::search_folders(options.texture_path, scene.file, "");

    // 1. Spaces and white
    const color::Space space = space_of(o.space, true, color::Space::Rec709, where, journal),
                       output = space_of(o.output, false, space, where, journal);
    setup.palette = std::make_unique<color::Palette>(space);
    setup.white = setup.palette->white();
    if (!o.white_balance.empty())
        try {
            setup.white = color::resolve_light(o.white_balance, setup.folders);
        } catch (const Error& e) {
            journal.error(where, std::string("white balance: ") + e.what() +
                                     ". The white of the scene's colour space stands in for it");
        }

    // 2. Observer, or camera
    auto observer = color::find_observer(o.observer);
    if (!observer) {
        journal.error(where,
                      "the observer \"" + o.observer +
                          "\" is neither 1931 (2 degrees) nor 1964 (10 degrees); 1931 stands in for it");
        observer = color::Observer::Cie1931;
    }
    setup.sensor = color::make_sensor(*observer, setup.white, output);
    const auto find = [&](const std::string& name) {
        constexpr const char* AsNamed[] = {""};
        const auto path = shade::find_file(name, setup.folders, AsNamed);
        if (!path)
            throw Error("the file \"" + name + "\" is not found; searched in " +
                        shade::join_folders(setup.folders));
        return *path;
    };
    if (!o.sensor.empty())
        try {
            std::vector<color::Table> training;
            if (!o.training.empty()) {
                const color::SpectrumColumns c = color::read_columns(find(o.training));
                for (size_t i = 0; i < c.columns.size(); i++)
                    training.push_back(c.column(i).table(color::Spectrum::Ends::Hold));
            }
            const std::string path = find(o.sensor);
            setup.sensor = color::make_camera(color::read_columns(path), path, setup.white, output, training);
        } catch (const Error& e) {
            journal.error(where, std::string("the camera's sensitivities cannot be used: ") + e.what() +
                                     ". The observer stands in for them");
        }

    // 3. Exposure
    const auto number = [&](float v, const char* name, float least, float most, float instead) {
        if (v >= least && v <= most)
            return v;
        journal.error(where, "exposure: " + std::string(name) + " " + std::to_string(v) + " lies beyond " +
                                 std::to_string(least) + " to " + std::to_string(most) + "; it is not used");
        return instead;
    };
    setup.exposure.f_stop = number(o.f_stop, "fstop", 0, 1e4f, 0);
    setup.exposure.shutter = number(o.shutter, "shutter", 0, 1e6f, 0);
    setup.exposure.iso = number(o.iso, "iso", 1e-3f, 1e8f, 100);
    setup.exposure.stops = number(o.stops, "stops", -100, 100, 0);
    if ((setup.exposure.f_stop > 0) != (setup.exposure.shutter > 0))
        journal.warning(where, "an exposure needs both fstop and shutter (seconds); one alone does nothing");
    return setup;
}

} // namespace kanuka::render
