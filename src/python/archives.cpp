#include "python/archives.h"

#include <filesystem>
#include <map>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/vector.h>

#include "python/keywords.h"
#include "python/procedurals.h"
#include "python/supervisor.h"

namespace kanuka::python {

scene::Scene read_archive(const std::string& path, const ingest::RibOptions& options, Journal& journal) {
    std::string quoted;
    for (const char c : std::filesystem::absolute(path).string())
        quoted += (c == '"' || c == '\\' ? "\\" : "") + std::string(1, c);
    return ingest::parse_rib("WorldBegin\nReadArchive \"" + quoted + "\"\nWorldEnd\n", path, options,
                             journal);
}

namespace {

// Makes what was read a part of another scene.
class Adopter {
  public:
    explicit Adopter(Scene& scene) : m_scene(scene), m_first_group(int(scene.scene.groups.size())) {}

    // Nodes get their ids where they are added, and groups are numbered on from the scene's.
    scene::NodeId add(scene::Group group) {
        group.node = scene::NodeId::None;
        for (scene::Primitive& p : group.primitives) {
            p.node = scene::NodeId::None, p.id = m_scene.next_id++;
            p.attributes = lit(p.attributes);
        }
        for (scene::Solid& s : group.solids)
            s.node = scene::NodeId::None;
        for (scene::Group::Instances& i : group.instances)
            i.node = scene::NodeId::None, i.group += m_first_group;
        return m_scene.editor->add(std::move(group)).node;
    }

  private:
    using Attributes = std::shared_ptr<const scene::Attributes>;
    // By all lights of the scene: Illuminate spoke of those of the archive.
    Attributes lit(const Attributes& attributes) {
        if (!attributes || !attributes->lights_on)
            return attributes;
        Attributes& after = m_lit[attributes];
        if (!after) {
            auto changed = std::make_shared<scene::Attributes>(*attributes);
            changed->lights_on = nullptr;
            after = std::move(changed);
        }
        return after;
    }

    Scene& m_scene;
    const int m_first_group;
    std::map<Attributes, Attributes> m_lit;
};

void tell_of_lights(const scene::Scene& read, const std::string& path, Journal& journal) {
    if (const size_t lights = read.lights.size() + read.light_shaders.size())
        journal.warning(Location{path},
                        std::to_string(lights) +
                            " lights of an archive are left out: groups have none. Add them to "
                            "the scene, or let a surface of the archive shine");
}

Group add_archive(std::shared_ptr<Scene> scene, const std::filesystem::path& path, const std::string& name,
                  const std::vector<std::string>& archive_path, bool run_programs, nb::dict procedurals,
                  std::shared_ptr<Journal> journal) {
    check_idle(*scene);
    if (scene->delayed)
        throw nb::value_error("a scene that is read on demand takes no more groups: load it with "
                              "on_demand=False");
    const Messages messages(std::move(journal));
    ingest::RibOptions options;
    options.archive_path = archive_path;
    for (const std::string& folder : scene->options.archive_path)
        options.archive_path.push_back(folder);
    options.run_programs = run_programs;
    options.procedural = plug_ins(std::move(procedurals));
    if (!std::filesystem::is_regular_file(path))
        throw Error(Location{path.string()}, "there is no such archive", ExitCode::Input);
    scene::Scene read;
    Supervisor supervisor{nb::none()};
    supervisor.run(
        [&] {
            read = read_archive(path.string(), options, *messages.journal);
            tell_of_lights(read, path.string(), *messages.journal);
        },
        messages);
    supervisor.rethrow_interrupt();
    Adopter adopter(*scene);
    for (scene::Group& group : read.groups)
        adopter.add(std::move(group));
    scene::Group all;
    all.name = name.empty() ? path.stem().string() : name;
    all.primitives = std::move(read.primitives);
    all.solids = std::move(read.solids);
    all.instances = std::move(read.instances);
    const scene::NodeId id = adopter.add(std::move(all));
    scene->numbers.clear(); // they are found anew
    tell_of_repeat(*scene);
    return {std::move(scene), id};
}

} // namespace

void bind_archives(nb::class_<Scene>& scene) {
    define(scene, "add_archive", &add_archive, nb::arg("path"), nb::kw_only(), nb::arg("name") = "",
           nb::arg("archive_path") = nb::list(), nb::arg("run_programs") = true,
           nb::arg("procedurals") = nb::dict(), nb::arg("journal") = nb::none(),
           "Reads a RIB archive, which a file that ReadArchive names is, as a group: add_instances() places "
           "it, as "
           "often as\nthere are matrices. With its groups and solids; its lights are left out, which is "
           "told.\n\n"
           "name: default, that of the file. Other arguments as of load(). Archives that it names are looked "
           "for beside it, in\n`archive_path`, and then in the scene's options.archive_path. Raises "
           "kanuka.Error "
           "where there is no such file.",
           nb::sig("def add_archive(self, path: str | os.PathLike, *, name: str = '', archive_path: "
                   "Sequence[str] = (), run_programs: bool = True, procedurals: dict = {}, "
                   "journal: Journal | None = None) -> Group"));
}

} // namespace kanuka::python
