#include "render/checkpoint.h"

#include <cstdio>
#include <cstring>
#include <memory>

#include "film/atomic_file.h"

namespace kanuka::render {

namespace {

constexpr uint32_t Magic = 0x504b4d4b, Version = 2; // "KMKP"

struct Header {
    uint32_t magic = Magic, version = Version;
    Digest key;
    int32_t x0, y0, x1, y1;
    uint64_t aovs, buckets, stopping;
};
static_assert(sizeof(Header) == 64); // no padding: it is written as it is

struct Closer {
    void operator()(std::FILE* f) const { std::fclose(f); }
};

Header header_of(const Digest& key, const Accumulator& gathered) {
    const Window& w = gathered.window();
    return {.key = key,
            .x0 = w.x0,
            .y0 = w.y0,
            .x1 = w.x1,
            .y1 = w.y1,
            .aovs = gathered.aov_sums().size() / std::max<size_t>(gathered.pixels().size(), 1),
            .buckets = gathered.buckets(),
            .stopping = gathered.stopped().size()};
}

} // namespace

void save_checkpoint(const std::string& path, const Digest& key, const Accumulator& gathered) {
    film::AtomicFile file(path);
    Digester sum;
    const auto write = [&](const void* data, size_t size) {
        file.write(data, size);
        sum.bytes(data, size);
    };
    const Header header = header_of(key, gathered);
    write(&header, sizeof header);
    const auto& done = gathered.done();
    write(done.data(), done.size() * sizeof done[0]);
    write(gathered.stopped().data(), gathered.stopped().size() * sizeof(int));
    write(gathered.pixels().data(), gathered.pixels().size() * sizeof gathered.pixels()[0]);
    write(gathered.aov_sums().data(), gathered.aov_sums().size() * sizeof(float));
    const Digest whole = sum.digest();
    file.write(&whole, sizeof whole);
    file.commit();
}

void load_checkpoint(const std::string& path, const Digest& key, Accumulator& gathered) {
    const auto refuse = [&](const std::string& why) {
        return Error(Location{path}, why + "; remove it, or name another file, to begin anew");
    };
    const std::unique_ptr<std::FILE, Closer> file(std::fopen(path.c_str(), "rb"));
    if (!file)
        throw Error(Location{path}, std::string("cannot be opened: ") + std::strerror(errno));
    Digester sum;
    const auto read = [&](void* data, size_t size) {
        if (size > 0 && std::fread(data, size, 1, file.get()) != 1)
            throw refuse("the checkpoint ends early");
        sum.bytes(data, size);
    };
    // The magic number by itself: a short file of another kind did not end early.
    Header header;
    if (std::fread(&header.magic, sizeof header.magic, 1, file.get()) != 1 || header.magic != Magic)
        throw refuse("this is no checkpoint");
    sum.bytes(&header.magic, sizeof header.magic);
    read(reinterpret_cast<char*>(&header) + sizeof header.magic, sizeof header - sizeof header.magic);
    if (header.version != Version)
        throw refuse("the checkpoint is of another version of Kanuka");
    const Header own = header_of(key, gathered);
    if (header.key != key)
        throw refuse(
            "the checkpoint is of another picture: the scene, a file that it names, or an option has "
            "changed");
    if (std::memcmp(&header, &own, sizeof header) != 0)
        throw refuse("the checkpoint is damaged: its sizes are not the picture's");
    std::vector<int> done(gathered.done().size()), stopped(gathered.stopped().size());
    std::vector<transport::PixelSums> pixels(gathered.pixels().size());
    std::vector<float> aovs(gathered.aov_sums().size());
    read(done.data(), done.size() * sizeof done[0]);
    read(stopped.data(), stopped.size() * sizeof stopped[0]);
    read(pixels.data(), pixels.size() * sizeof pixels[0]);
    read(aovs.data(), aovs.size() * sizeof aovs[0]);
    const Digest whole = sum.digest();
    Digest written;
    read(&written, sizeof written);
    if (written != whole)
        throw refuse("the checkpoint is damaged: its checksum does not match");
    gathered.restore(std::move(done), std::move(stopped), std::move(pixels), std::move(aovs));
}

} // namespace kanuka::render
