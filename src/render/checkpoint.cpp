#include "render/checkpoint.h"

#include <cstdio>
#include <cstring>
#include <memory>
#include <sys/stat.h>

#include "film/atomic_file.h"
#include "render/development_record.h"

namespace kanuka::render {

namespace {

constexpr uint32_t Magic = 0x504b4d4b, Version = 3; // "KMKP"

struct Header {
    uint32_t magic = Magic, version = Version;
    Digest key;
    int32_t x0, y0, x1, y1;
    uint64_t aovs, buckets, stopping;
    int32_t first;
    uint32_t record; // bytes
};
static_assert(sizeof(Header) == 72); // no padding: it is written as it is

struct Closer {
    void operator()(std::FILE* f) const { std::fclose(f); }
};

Error refusal(const std::string& path, const std::string& why) {
    return Error(Location{path}, why + "; remove it, or name another file, to begin anew");
}

// A file from its beginning on, and what is wrong with it.
class Reader {
  public:
    explicit Reader(const std::string& path) : m_path(path), m_file(std::fopen(path.c_str(), "rb")) {
        struct stat about{};
        if (!m_file || fstat(fileno(m_file.get()), &about) != 0)
            throw Error(Location{path}, std::string("cannot be opened: ") + std::strerror(errno));
        m_size = uint64_t(about.st_size);
        // The magic number by itself: a short file of another kind did not end early.
        if (std::fread(&header.magic, sizeof header.magic, 1, m_file.get()) != 1 || header.magic != Magic)
            throw refuse("this is no checkpoint");
        m_sum.bytes(&header.magic, sizeof header.magic);
        read(reinterpret_cast<char*>(&header) + sizeof header.magic, sizeof header - sizeof header.magic);
        if (header.version != Version)
            throw refuse("the checkpoint is of another version of Kanuka");
    }

    Error refuse(const std::string& why) const { return refusal(m_path, why); }
    Error damaged(const char* how) const { return refuse(std::string("the checkpoint is damaged: ") + how); }
    void read(void* data, size_t size) {
        if (size > 0 && std::fread(data, size, 1, m_file.get()) != 1)
            throw refuse("the checkpoint ends early");
        m_sum.bytes(data, size);
    }
    template <class T>
    void read(std::vector<T>& values) {
        read(values.data(), values.size() * sizeof(T));
    }
    Digest digest() const { return m_sum.digest(); }
    uint64_t size() const { return m_size; }

    Header header{};

  private:
    std::string m_path;
    std::unique_ptr<std::FILE, Closer> m_file;
    uint64_t m_size = 0;
    Digester m_sum;
};

// Buckets as the header has them, each with its progressions; the file is long enough for their sums. Nothing
// is taken for granted: the checksum comes last.
Accumulator begin(Reader& reader) {
    const Header& h = reader.header;
    constexpr int Most = 1 << 30;
    const auto in_range = [](int lo, int hi) { return lo >= 0 && lo < hi && hi <= Most; };
    const Window window{h.x0, h.y0, h.x1, h.y1};
    const auto wrong = [&] { return reader.damaged("its sizes are none"); };
    if (!in_range(h.x0, h.x1) || !in_range(h.y0, h.y1) || h.first < 0 || h.first % BlockSize != 0 ||
        h.buckets != buckets_of(window) || (h.stopping != 0 && h.stopping != window.pixels()))
        throw wrong();
    if (h.buckets > reader.size() || h.stopping > reader.size() || h.aovs > (1 << 20))
        throw reader.refuse("the checkpoint ends early");
    std::vector<int> done(h.buckets);
    reader.read(done);
    Accumulator gathered(window, h.aovs, h.stopping > 0, h.first);
    const uint64_t a_pixel = sizeof(transport::PixelSums) + sizeof(float) * h.aovs;
    uint64_t size =
        sizeof h + h.record + done.size() * sizeof(int) + h.stopping * sizeof(int) + sizeof(Digest);
    for (size_t b = 0; b < done.size(); b++) {
        if (done[b] < h.first || done[b] > Most)
            throw wrong();
        Accumulator::Bucket& bucket = gathered.bucket(b);
        bucket.done = done[b];
        size += uint64_t(gathered.sums_at(done[b])) * bucket.area.pixels() * a_pixel;
        if (size > reader.size())
            throw reader.refuse("the checkpoint ends early");
    }
    if (size < reader.size())
        throw wrong();
    return gathered;
}

Checkpoint load(Reader& reader) {
    Checkpoint checkpoint{reader.header.key, {}, begin(reader)};
    Accumulator& gathered = checkpoint.gathered;
    std::string record(reader.header.record, '\0');
    reader.read(record.data(), record.size());
    for (size_t b = 0; b < gathered.buckets(); b++) {
        Accumulator::Bucket& bucket = gathered.bucket(b);
        reader.read(bucket.stopped);
        for (size_t i = 0; i < bucket.stopped.size(); i++)
            bucket.takes_part[i] = bucket.stopped[i] == 0;
    }
    for (size_t b = 0; b < gathered.buckets(); b++) {
        Accumulator::Bucket& bucket = gathered.bucket(b);
        for (size_t k = gathered.sums_at(bucket.done); k > 0; k--) {
            Sums& sums = bucket.sums.emplace_back(gathered.zeros(bucket));
            reader.read(sums.pixels), reader.read(sums.aovs);
        }
    }
    const Digest whole = reader.digest();
    Digest written;
    reader.read(&written, sizeof written);
    if (written != whole)
        throw reader.damaged("its checksum does not match");
    if (!unpack(record, checkpoint.how) || 3 * checkpoint.how.layers.count() != gathered.aovs())
        throw reader.damaged("its record is none");
    return checkpoint;
}

} // namespace

film::Picture Checkpoint::picture() const {
    if (gathered.first() > 0)
        throw Error("these are " + progressions_text(gathered.first(), gathered.least_done()) +
                    " of a picture: those from 0 on are missing");
    if (gathered.least_done() == 0)
        throw Error("there is no picture yet: some pixels have no samples");
    if (how.imager)
        throw Error(
            "the picture has an imager, a shader of the scene: save the checkpoint, and render the scene "
            "with it");
    return develop(gathered, how);
}

void save_checkpoint(const std::string& path, const Digest& key, const Development& how,
                     const Accumulator& gathered) {
    film::AtomicFile file(path);
    Digester sum;
    const auto write = [&](const void* data, size_t size) {
        file.write(data, size);
        sum.bytes(data, size);
    };
    const Window& w = gathered.window();
    const std::string record = packed(how);
    const Header header{.key = key,
                        .x0 = w.x0,
                        .y0 = w.y0,
                        .x1 = w.x1,
                        .y1 = w.y1,
                        .aovs = gathered.aovs(),
                        .buckets = gathered.buckets(),
                        .stopping = gathered.stops() ? w.pixels() : 0,
                        .first = gathered.first(),
                        .record = uint32_t(record.size())};
    write(&header, sizeof header);
    std::vector<int> done(gathered.buckets());
    for (size_t b = 0; b < done.size(); b++)
        done[b] = gathered.bucket(b).done;
    write(done.data(), done.size() * sizeof done[0]);
    write(record.data(), record.size());
    for (size_t b = 0; b < gathered.buckets(); b++) {
        const std::vector<int>& stopped = gathered.bucket(b).stopped;
        write(stopped.data(), stopped.size() * sizeof(int));
    }
    for (size_t b = 0; b < gathered.buckets(); b++)
        for (size_t k = 0; k < gathered.sums_at(done[b]); k++) {
            const Sums& sums = gathered.bucket(b).sums[k];
            write(sums.pixels.data(), sums.pixels.size() * sizeof sums.pixels[0]);
            write(sums.aovs.data(), sums.aovs.size() * sizeof(float));
        }
    const Digest whole = sum.digest();
    file.write(&whole, sizeof whole);
    file.commit();
}

CheckpointHead read_checkpoint_head(const std::string& path) {
    Reader reader(path);
    const Accumulator gathered = begin(reader);
    return {path,
            reader.header.key,
            gathered.window(),
            gathered.aovs(),
            gathered.stops(),
            gathered.first(),
            gathered.least_done(),
            gathered.most_done(),
            reader.size()};
}

Checkpoint load_checkpoint(const std::string& path) {
    Reader reader(path);
    return load(reader);
}

void resume_checkpoint(const std::string& path, const Digest& key, const Part* part, Accumulator& gathered) {
    Reader reader(path);
    const Header& h = reader.header;
    if (h.key != key)
        throw reader.refuse(
            "the checkpoint is of another picture: the scene, a file that it names, or an option has "
            "changed");
    const Window& w = gathered.window();
    if (Window{h.x0, h.y0, h.x1, h.y1} != w || h.aovs != gathered.aovs() ||
        (h.stopping > 0) != gathered.stops())
        throw reader.damaged("its sizes are not the picture's");
    Checkpoint loaded = load(reader);
    const Accumulator& found = loaded.gathered;
    if (found.first() != gathered.first())
        throw reader.refuse("the checkpoint begins at progression " + std::to_string(found.first()) +
                            " of the picture, and what is wanted at " + std::to_string(gathered.first()) +
                            (part ? "" : ": kanuka merge joins it with the parts before"));
    if (part && found.most_done() > part->end)
        throw reader.refuse("the checkpoint has " + progressions_text(found.first(), found.most_done()) +
                            ", and the part is " + progressions_text(part->first, part->end));
    gathered = std::move(loaded.gathered);
}

} // namespace kanuka::render
