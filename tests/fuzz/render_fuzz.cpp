// Whole renders of mutated input at 16 by 12 pixels: from the parser to pixels.
//
//   build/tests/fuzz/kanuka_render_fuzz scenes --count 100000 --keep FOLDER
//   build/tests/fuzz/kanuka_render_fuzz shaders|slo|cache|textures|pages …
//   … --first SEED --count 1 --print     what one seed renders, and how it went
//   … --file FILE                        a kept input again
//   … found --folder FOLDER              all that were kept there, each of the kind that its name says
//   … --shader-cache FOLDER              compiled shaders from run to run: most of a run's first minutes
//
// A case is its seed: the same on every machine. Each runs in a forked worker (worker.h); what crashes,
// hangs, takes too much memory, ends with an exception that is no Error or leaves a pixel that is not a
// number is written to FOLDER under its seed. Cases that end with an Error leave no picture: both are
// counted.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <unistd.h>
#include <zlib.h>

#include "film/film.h"
#include "ingest/rib/rib.h"
#include "mutate.h"
#include "render/session.h"
#include "sample_pictures.h"
#include "shade/make_texture.h"
#include "sl/codegen/cache.h"
#include "sl/frontend.h"
#include "store/disk_store.h"
#include "store/page_check.h"
#include "worker.h"

namespace {

using namespace kanuka;
using fuzz::Random;
namespace fs = std::filesystem;

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}
void write(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

struct Source {
    std::string name, bytes;
};
std::vector<Source> read_all(const std::vector<fs::path>& folders, const char* suffix,
                             size_t most = 1 << 16) {
    std::vector<fs::path> paths;
    for (const fs::path& folder : folders)
        for (const auto& entry : fs::directory_iterator(folder))
            if (entry.path().extension() == suffix && entry.file_size() <= most)
                paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    std::vector<Source> all;
    for (const fs::path& p : paths)
        all.push_back({p.filename().string(), read(p)});
    return all;
}

bool names_foreign_files(const std::string& text) {
    return text.find("\"/") != std::string::npos || text.find("</") != std::string::npos ||
           text.find("..") != std::string::npos || text.find('~') != std::string::npos;
}

fuzz::Outcome render_text(const std::string& text, bool print) {
    Journal journal;
    Stats stats;
    fuzz::Outcome outcome;
    try {
        ingest::RibOptions options;
        options.run_programs = false;
        options.most_procedurals = 256;
        const scene::Scene scene = ingest::parse_rib(text, "fuzz.rib", options, journal);
        render::Overrides overrides;
        overrides.options.set("resolution", scene::Setting{{16, 12}, {}});
        overrides.options.set("samples", 1);
        // By the input, so that a kept one runs as it did: mostly as users run it, else other code.
        constexpr int Lanes[] = {0, 0, 0, 0, 1, 16, 8, 0};
        overrides.lanes = Lanes[text.size() % std::size(Lanes)];
        overrides.threads = text.size() % 5 == 0 ? 3 : 1;
        overrides.pages_from = text.size() % 2 == 0 ? 0 : overrides.pages_from; // all in our own pages
        overrides.standard_shaders = KANUKA_SOURCE_DIR "/shaders";
        const render::Result result = render::render(scene, overrides, journal, stats, {});
        for (const film::Picture::Channel& c : result.picture.channels)
            for (const float x : c.data)
                if (std::isnan(x) || (std::isinf(x) && c.name != "Z")) // Z: nothing there
                    outcome.fault = "pixels of " + c.name + " that are not finite";
        outcome.picture = true;
    } catch (const Error& e) { // no picture, and said why
        if (print)
            std::printf("error: %s\n", e.what());
    }
    if (print)
        for (const Journal::Entry& e : journal.entries())
            std::printf("%s: %s (%d)\n", e.where.str().c_str(), e.message.c_str(), int(e.count));
    return outcome;
}

// ---- kinds of input
// ----------------------------------------------------------------------------------------------

struct Kind {
    std::string suffix;
    // The input that the seed makes.
    std::function<std::string(uint64_t)> make;
    // Renders it.
    std::function<fuzz::Outcome(const std::string&, bool)> run;
};

Kind scenes() {
    auto all = std::make_shared<std::vector<Source>>(
        read_all({KANUKA_SOURCE_DIR "/tests/fuzz/corpus", KANUKA_SOURCE_DIR "/scenes"}, ".rib", 12000));
    return {".rib",
            [all](uint64_t seed) {
                Random random(seed);
                const Source& base = (*all)[random.below(all->size())];
                return fuzz::mutate_text(base.bytes, (*all)[random.below(all->size())].bytes, random);
            },
            [](const std::string& text, bool print) {
                return names_foreign_files(text) || text.size() > 200000 ? fuzz::Outcome{}
                                                                         : render_text(text, print);
            }};
}

// A scene in which the shader "fuzz" is everything that a shader may be.
std::string scene_of(const std::string& file) {
    return "Option \"searchpath\" \"shader\" \".\"\nProjection \"perspective\" \"fov\" 50\nTranslate 0 0 "
           "3\nWorldBegin\n"
           "LightSource \"distantlight\" 1\nLightSource \"fuzz\" 2\nAtmosphere \"fuzz\"\nDisplacement "
           "\"fuzz\"\n"
           "Surface \"fuzz\"\nSphere 1 -1 1 360\nPolygon \"P\" [-2 -1 -1 2 -1 -1 2 -1 1 -2 -1 1]\n"
           "Surface \"matte\"\nInterior \"fuzz\"\nSphere 0.5 -0.5 0.5 360\nWorldEnd\n# " +
           file + "\n";
}

// The cache stays: what it has of other shaders is as good, and of this one it has nothing.
fuzz::Outcome run_shader(const std::string& bytes, const char* file, bool print) {
    fs::remove("fuzz.sl");
    fs::remove("fuzz.slo");
    write(file, bytes);
    return render_text(scene_of(file), print);
}

Kind shaders() {
    auto all = std::make_shared<std::vector<Source>>(
        read_all({KANUKA_SOURCE_DIR "/shaders", KANUKA_SOURCE_DIR "/tests/shaders"}, ".sl"));
    return {".sl",
            [all](uint64_t seed) {
                Random random(seed);
                const Source& base = (*all)[random.below(all->size())];
                return fuzz::mutate_text(base.bytes, (*all)[random.below(all->size())].bytes, random);
            },
            [](const std::string& text, bool print) {
                return names_foreign_files(text) ? fuzz::Outcome{} : run_shader(text, "fuzz.sl", print);
            }};
}

// A published shader whose tokens are damaged, and packed again as if they were not (slo.cpp: Header).
struct PublishedHeader {
    uint64_t metadata, metadata_bytes, tokens, tokens_bytes, hash, checksum;
};
constexpr size_t PublishedMagic = 9;

void make_checksum_fit(std::string& slo) {
    PublishedHeader h;
    constexpr size_t Body = PublishedMagic + sizeof h;
    if (slo.size() <= Body)
        return;
    std::memcpy(&h, slo.data() + PublishedMagic, sizeof h);
    h.checksum = 0;
    h.checksum = sl::hash_bytes(slo.data() + Body, slo.size() - Body, sl::hash_bytes(&h, sizeof h));
    std::memcpy(slo.data() + PublishedMagic, &h, sizeof h);
}

std::string with_damaged_tokens(const std::string& slo, Random& random) {
    PublishedHeader h;
    std::memcpy(&h, slo.data() + PublishedMagic, sizeof h);
    const size_t at = PublishedMagic + sizeof h + h.metadata;
    std::string tokens(h.tokens_bytes, '\0');
    uLongf size = uLongf(tokens.size());
    uncompress(reinterpret_cast<Bytef*>(tokens.data()), &size,
               reinterpret_cast<const Bytef*>(slo.data() + at), uLong(h.tokens));
    fuzz::mutate_bytes(tokens, random);
    size = compressBound(uLong(tokens.size()));
    std::string packed(size, '\0');
    compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(tokens.data()),
              uLong(tokens.size()), 1);
    h.tokens = size, h.tokens_bytes = tokens.size();
    std::string out = slo.substr(0, at) + packed.substr(0, size);
    std::memcpy(out.data() + PublishedMagic, &h, sizeof h);
    make_checksum_fit(out);
    return out;
}

// Published shaders: damaged as they lie on disk, or with a checksum that fits, or inside of what is packed,
// so that all that reads them meets the damage.
Kind slo() {
    auto all = std::make_shared<std::vector<std::string>>();
    for (const Source& s : read_all({KANUKA_SOURCE_DIR "/shaders"}, ".sl")) {
        Journal journal;
        sl::FrontEnd front(s.name, s.bytes, {}, journal);
        if (const auto program = front.check() ? front.lower() : std::nullopt)
            all->push_back(sl::write_slo(front.sources(), front.source(), *program));
    }
    return {".slo",
            [all](uint64_t seed) {
                Random random(seed);
                std::string bytes = (*all)[random.below(all->size())];
                if (seed % 4 >= 2)
                    return with_damaged_tokens(bytes, random);
                fuzz::mutate_bytes(bytes, random);
                if (seed % 4 == 1)
                    make_checksum_fit(bytes);
                return bytes;
            },
            // Names of files are packed in it: what it says by chance ("..") is none.
            [](const std::string& bytes, bool print) { return run_shader(bytes, "fuzz.slo", print); }};
}

// Entries of the shader cache.
Kind cache() {
    return {".kso", [](uint64_t seed) { return std::to_string(seed); },
            [](const std::string& text, bool print) {
                Random random(std::strtoull(text.c_str(), nullptr, 10));
                render_text(scene_of(""), false);
                std::vector<fs::path> entries;
                std::error_code none;
                for (const auto& e : fs::directory_iterator("shader_cache", none))
                    entries.push_back(e.path());
                std::sort(entries.begin(), entries.end());
                for (const fs::path& e : entries) {
                    std::string bytes = read(e);
                    fuzz::mutate_bytes(bytes, random);
                    write(e, bytes);
                }
                return render_text(scene_of(""), print);
            }};
}

Kind textures() {
    auto all = std::make_shared<std::vector<Source>>();
    fuzz::in_child([] {
        const film::Picture picture = fuzz::sample_picture();
        film::write_exr("sample.exr", picture);
        film::write_png("sample.png", picture, 1, 1);
        shade::TextureMaking making;
        making.pictures = {"sample.exr"};
        making.texture = "sample.tx.exr";
        shade::make_texture(making);
    });
    for (const char* name : {"sample.exr", "sample.png", "sample.tx.exr"})
        all->push_back({name, read(name)});
    all->push_back({"sample.bmp", fuzz::sample_bmp()});
    all->push_back({"sample.tif", fuzz::sample_tiff()});
    // The name of the file goes before its bytes.
    return {".picture",
            [all](uint64_t seed) {
                Random random(seed);
                const Source& base = (*all)[random.below(all->size())];
                std::string bytes = base.bytes;
                fuzz::mutate_bytes(bytes, random);
                return base.name.substr(base.name.find('.')) + "\n" + bytes;
            },
            [](const std::string& bytes, bool print) {
                const size_t end = bytes.find('\n');
                const std::string file = "fuzz" + bytes.substr(0, end);
                for (const auto& e : fs::directory_iterator("."))
                    if (e.path().filename().string().starts_with("fuzz."))
                        fs::remove(e.path());
                write(file, bytes.substr(end + 1));
                const std::string named = '"' + file + '"';
                return render_text(
                    "MakeTexture " + named +
                        " \"made.tx\" \"periodic\" \"clamp\" \"gaussian\" 2 2\n"
                        "Option \"searchpath\" \"texture\" \".\"\nTranslate 0 0 3\nWorldBegin\n"
                        "LightSource \"environmentlight\" 1 \"envname\" " +
                        named + "\nLight \"PxrRectLight\" \"r\" \"string lightColorMap\" " + named +
                        "\nSurface \"paintedplastic\" \"texturename\" " + named +
                        "\nPolygon \"P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0]\n"
                        "Surface \"paintedmatte\" \"texturename\" \"made.tx\"\nSphere 1 -1 1 360\n"
                        "WorldEnd\n",
                    print);
            }};
}

// Packs of the store: what is damaged is refused.
Kind packs() {
    grid::Grid g;
    g.allocate(4, 4);
    for (int i = 0; i < g.vertices(); i++) {
        g.P[size_t(i)] = float(i % 5), g.P[size_t(i + g.stride)] = float(i / 5);
        g.N[size_t(i + 2 * g.stride)] = 1;
    }
    grid::TracedGrid traced;
    traced.mu = traced.mv = 4;
    for (int i = 0; i < g.vertices(); i++)
        for (const float x : {float(i % 5), float(i / 5), 0.0f})
            traced.P.push_back(x);
    grid::LayeringProgram program;
    program.nodes.resize(1);
    const grid::VertexInputs inputs;
    const store::ShadedGrid shaded{&g, &traced, nullptr, &inputs};
    fuzz::in_child([&] {
        uint64_t bad = 0;
        Journal journal;
        store::DiskStore disk({.folder = "sample"}, journal);
        disk.write({.content = {1, 2}, .of_read = {}, .reads = "0", .palette = {}},
                   std::make_shared<const store::Page>(store::encode({&shaded, 1}, program, bad)));
    });
    const std::string pack = read(std::filesystem::directory_iterator("sample")->path().string());
    return {".kpack",
            [pack](uint64_t seed) {
                Random random(seed);
                std::string bytes = pack;
                fuzz::mutate_bytes(bytes, random);
                return bytes == pack ? bytes.substr(1) : bytes;
            },
            [program, pack](const std::string& bytes, bool print) -> fuzz::Outcome {
                std::filesystem::create_directory("fuzz");
                write("fuzz/fuzz.kpack", bytes);
                Journal journal;
                store::DiskStore disk({.folder = "fuzz", .writes = false}, journal);
                for (const store::StoredPage& stored : disk.find({1, 2})) {
                    store::Page page;
                    if (!disk.read(stored, program, page))
                        continue;
                    page.header().key[0] = 1, page.header().key[1] = 2;
                    page.header().checksum = store::checksum_of(page.header(), page);
                    const std::string_view words(reinterpret_cast<const char*>(page.words.data()),
                                                 page.words.size() * 4);
                    if (pack.find(words) == std::string::npos)
                        return {"a damaged page was taken"};
                }
                if (print)
                    for (const Journal::Entry& e : journal.entries())
                        std::printf("%s\n", e.message.c_str());
                return {};
            }};
}

// Inputs that fell once: the case is the number of the file, in order of names.
Kind found(const std::string& folder) {
    auto kinds = std::make_shared<std::vector<Kind>>();
    kinds->push_back(scenes());
    kinds->push_back(shaders());
    kinds->push_back(textures());
    auto all = std::make_shared<std::vector<std::pair<size_t, Source>>>();
    for (size_t k = 0; k < kinds->size(); k++)
        for (Source& s : read_all({folder}, (*kinds)[k].suffix.c_str()))
            all->push_back({k, std::move(s)});
    return {"", [all](uint64_t number) { return number < all->size() ? std::to_string(number) : ""; },
            [all, kinds](const std::string& number, bool print) -> fuzz::Outcome {
                if (number.empty())
                    return {};
                const auto& [kind, source] = (*all)[std::strtoull(number.c_str(), nullptr, 10)];
                fuzz::Outcome outcome = (*kinds)[kind].run(source.bytes, print);
                if (!outcome.fault.empty())
                    outcome.fault = source.name + ": " + outcome.fault;
                return outcome;
            }};
}

} // namespace

int main(int count, char** argument) {
    std::string kind_name = count > 1 ? argument[1] : "scenes", keep, file, folder, shader_cache;
    uint64_t first = 0, cases = 200;
    bool print = false;
    fuzz::Limits limits;
    for (int i = 2; i < count; i++) {
        const std::string option = argument[i];
        const char* value = i + 1 < count ? argument[i + 1] : "";
        if (option == "--print")
            print = true;
        else if (option == "--first")
            first = std::strtoull(value, nullptr, 10), i++;
        else if (option == "--count")
            cases = std::strtoull(value, nullptr, 10), i++;
        else if (option == "--seconds")
            limits.seconds = std::strtod(value, nullptr), i++;
        else if (option == "--keep")
            keep = fs::absolute(value).string(), i++;
        else if (option == "--file")
            file = fs::absolute(value).string(), i++;
        else if (option == "--shader-cache")
            shader_cache = fs::absolute(value).string(), i++;
        else if (option == "--folder")
            folder = fs::absolute(value).string(), i++;
    }
    if (!keep.empty())
        fs::create_directories(keep);
    // Everything that is written lies in a folder of this run.
    std::string scratch = (fs::temp_directory_path() / "kanuka-fuzz-XXXXXX").string();
    if (!mkdtemp(scratch.data()))
        return 2;
    fs::current_path(scratch);
    // What is damaged is this run's own.
    const bool own_cache = shader_cache.empty() || kind_name == "cache";
    setenv("KANUKA_SHADER_CACHE", (own_cache ? scratch + "/shader_cache" : shader_cache).c_str(), 1);
    setenv("KANUKA_SHADER_CACHE_SIZE", "256M", 1);
    fuzz::in_child([] { film::write_exr("picture.exr", fuzz::sample_picture()); });
    const Kind kind = kind_name == "shaders"    ? shaders()
                      : kind_name == "slo"      ? slo()
                      : kind_name == "cache"    ? cache()
                      : kind_name == "textures" ? textures()
                      : kind_name == "pages"    ? packs()
                      : kind_name == "found"    ? found(folder)
                                                : scenes();
    uint64_t found = 0;
    const auto input = [&](uint64_t seed) { return file.empty() ? kind.make(seed) : read(file); };
    const auto note = [&](const char* what, const fuzz::Finding& f) {
        std::printf("%s seed %llu: %s: %s\n", kind_name.c_str(), static_cast<unsigned long long>(f.seed),
                    what, f.what.c_str());
        std::fflush(stdout);
        if (!keep.empty())
            write(fs::path(keep) / (kind_name + "_" + std::to_string(f.seed) + kind.suffix), input(f.seed));
    };
    if (!file.empty())
        cases = 1;
    const fuzz::Totals ran = fuzz::run_cases(
        first, cases, limits,
        [&](uint64_t seed) {
            const std::string bytes = input(seed);
            if (print && cases == 1)
                std::printf("%s\n----\n", bytes.c_str());
            return kind.run(bytes, print);
        },
        [&](const fuzz::Finding& f) {
            found++;
            note("FOUND", f);
        },
        [&](const fuzz::Finding& f) { note("slow", f); });
    std::printf("%s: %llu cases from seed %llu, %llu pictures, %.1f s of processor time, %llu found\n",
                kind_name.c_str(), static_cast<unsigned long long>(ran.cases),
                static_cast<unsigned long long>(first), static_cast<unsigned long long>(ran.pictures),
                ran.seconds, static_cast<unsigned long long>(found));
    fs::current_path("/");
    fs::remove_all(scratch);
    return found > 0 ? 1 : 0;
}
