#include "python/render_request.h"

#include "base/byte_size.h"
#include "python/parameters.h"
#include "render/aovs.h"

namespace kanuka::python {

void check_layer(const std::string& text, const std::string& name) {
    try {
        render::check_layer(text);
    } catch (const Error& error) {
        throw nb::value_error((name + ": " + error.what()).c_str());
    }
}

namespace {

// To a member of the overrides; None leaves the scene's.
template <auto Member>
void over(RenderRequest& r, nb::handle value, const char* name) {
    r.overrides.*Member = argument<std::remove_cvref_t<decltype(r.overrides.*Member)>>(value, name);
}

using O = render::Overrides;

void over_aovs(RenderRequest& r, nb::handle value, const char* name) {
    over<&O::aovs>(r, value, name);
    for (const std::string& text : r.overrides.aovs)
        check_layer(text, name);
}
// Of an option, over the scene's; None leaves that.
void over_option(RenderRequest& r, nb::handle value, const char* name) {
    const scene::OptionParameter* row =
        scene::find_option(name == std::string_view("progressions") ? "samples" : name);
    if (!value.is_none())
        r.overrides.options.set(row->name, setting(*row, value, name));
}

template <class T>
T or_else(nb::handle value, const char* name, T none) {
    return value.is_none() ? none : argument<T>(value, name);
}

// As 500M or 20G; empty = None.
std::string size_of(nb::handle value, const char* name) {
    const std::string text = or_else<std::string>(value, name, "");
    if (!value.is_none() && !parse_byte_size(text))
        throw nb::value_error(
            (std::string(name) + ": expected a size as 500M or 20G, got \"" + text + "\"").c_str());
    return text;
}

constexpr Keyword<RenderRequest> OwnKeywords[] = {
    {"progressions", "int | None", "None", "paths a pixel", "None = the scene's samples, else 64",
     over_option},
    {"threads", "int | None", "None", "", "None = all there are; the picture is the same for any number",
     over<&O::threads>},
    {"shading_rate", "float | None", "None", "", "multiplies every object's micropolygon area",
     over<&O::shading_rate>},
    {"aovs", "Sequence[str]", "()", "",
     "layers beside those that the scene's displays name: output parameters of surface shaders, variables of "
     "objects (Pref is the reference position), and light path expressions as \"lpe:C<RD>L\"",
     over_aovs},
    {"lanes", "int", "0", "1, 8 or 16", "SIMD lanes; 0 = the widest. The picture is the same",
     over<&O::lanes>},
    {"store", "str | os.PathLike | None", "None", "",
     "folder that keeps what is diced and shaded for later renders, of many hosts; None = KANUKA_STORE, \"\" "
     "= "
     "none",
     [](RenderRequest& r, nb::handle value, const char* name) {
         if (!value.is_none())
             r.store = argument<std::filesystem::path>(value, name);
     }},
    {"store_mode", "str | None", "None", "read or write",
     "read: nothing is added; None = KANUKA_STORE_MODE, else write",
     [](RenderRequest& r, nb::handle value, const char* name) {
         r.store_mode = or_else<std::string>(value, name, "");
         if (!value.is_none() && r.store_mode != "read" && r.store_mode != "write")
             throw nb::value_error(
                 (std::string(name) + ": expected \"read\" or \"write\", got \"" + r.store_mode + "\"")
                     .c_str());
     }},
    {"store_size", "str | None", "None", "as 500M or 20G",
     "of the folder: what was not used for longest goes; None = KANUKA_STORE_SIZE, else 20G",
     [](RenderRequest& r, nb::handle value, const char* name) { r.store_size = size_of(value, name); }},
    {"oracle", "str | os.PathLike | None", "None", "",
     "file of write_oracle(): dices less where no ray looks closely, and finer where something magnifies",
     [](RenderRequest& r, nb::handle value, const char* name) {
         r.oracle = value.is_none() ? "" : argument<std::filesystem::path>(value, name).string();
     }},
    {"memory", "str | None", "None", "as 500M or 4G",
     "most of the memory that geometry may take: the rest waits on a disk (KANUKA_SCRATCH, TMPDIR), and "
     "comes where it "
     "is needed; None = KANUKA_MEMORY, else no bound",
     [](RenderRequest& r, nb::handle value, const char* name) { r.memory = size_of(value, name); }},
    {"progress", "Callable[[str, float], object] | None", "None", "",
     "called with the phase and its fraction, on the calling thread",
     [](RenderRequest& r, nb::handle value, const char* name) {
         if (!value.is_none() && !PyCallable_Check(value.ptr()))
             wrong_argument(name, "a callable or None", value);
         r.progress = nb::borrow(value);
     }},
    {"shot", "Sequence[Camera]", "()", "",
     "cameras of all frames that a session renders, one after the other: what stands still is diced for all",
     [](RenderRequest& r, nb::handle value, const char* name) {
         r.shot = argument<std::vector<Camera>>(value, name);
     }},
    {"journal", "Journal | None", "None", "", "takes the messages, which are warnings else",
     [](RenderRequest& r, nb::handle value, const char* name) {
         r.journal = argument<std::shared_ptr<Journal>>(value, name, true);
     }},
};

} // namespace

std::span<const Keyword<RenderRequest>> render_keywords() {
    static std::vector<std::string> types; // nothing moves once it is filled
    static const std::vector<Keyword<RenderRequest>> all = [] {
        const auto options = scene::option_parameters();
        types.reserve(options.size());
        std::vector<Keyword<RenderRequest>> table(std::begin(OwnKeywords), std::end(OwnKeywords));
        for (const scene::OptionParameter& row : options) {
            if (row.name == std::string_view("samples")) // progressions
                continue;
            types.push_back(annotation(row, false) + " | None");
            table.push_back({row.name, types.back().c_str(), "None", row.unit, row.about, over_option});
        }
        return table;
    }();
    return all;
}

void RenderRequest::complete(Scene& scene) {
    overrides.standard_shaders =
        nb::cast<std::string>(nb::module_::import_("kanuka.paths").attr("standard_shaders")());
    overrides.delayed = scene.delayed.get();
    overrides.store = store_settings();
    overrides.memory_budget = memory_budget();
    overrides.oracle = oracle;
    scene.scene.options = scene.options;
    scene::Options options = scene.options;
    overrides.options.apply(options);
    overrides.camera = scene.camera.resolve(options, options.width, options.height);
    for (const Camera& camera : shot)
        overrides.shot.push_back(camera.resolve(options, options.width, options.height));
}

store::DiskStore::Settings RenderRequest::store_settings() const {
    store::DiskStore::Settings settings = store::store_settings_of_environment();
    if (store)
        settings.folder = store->string();
    if (!store_mode.empty())
        settings.writes = store_mode == "write";
    if (!store_size.empty())
        settings.most_bytes = *parse_byte_size(store_size);
    return settings;
}

std::optional<MemoryBudget> RenderRequest::memory_budget() const {
    return memory.empty() ? std::nullopt : std::optional(MemoryBudget{*parse_byte_size(memory), {}});
}

} // namespace kanuka::python
