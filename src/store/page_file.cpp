// Pages on disk: header and words as they lie in memory.
#include <cstdio>
#include <memory>
#include <unistd.h>
#define XXH_INLINE_ALL // no library is needed where this runs
#include <xxhash.h>

#include "store/store.h"

namespace kanuka::store {

namespace {

struct Closer {
    void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, Closer>;
constexpr size_t HeaderWords = sizeof(PageHeader) / 4;

// Of the header too, its own place taken as zero: a wrong count or key is as bad as a wrong position.
uint64_t checksum(PageHeader header, const Page& page) {
    header.checksum = 0;
    const uint64_t seed = XXH3_64bits(&header, sizeof header);
    return XXH3_64bits_withSeed(page.words.data() + HeaderWords, (page.words.size() - HeaderWords) * 4, seed);
}

} // namespace

void write_page(const std::string& path, const Page& page) {
    PageHeader header = page.header();
    header.checksum = checksum(header, page);
    const std::string temporary = path + ".part" + std::to_string(getpid());
    {
        File f(std::fopen(temporary.c_str(), "wb"));
        const bool written = f && std::fwrite(&header, sizeof header, 1, f.get()) == 1 &&
                             std::fwrite(page.words.data() + HeaderWords, 4, page.words.size() - HeaderWords,
                                         f.get()) == page.words.size() - HeaderWords &&
                             std::fflush(f.get()) == 0 && fsync(fileno(f.get())) == 0;
        if (!written) {
            std::remove(temporary.c_str());
            throw Error("cannot write " + path + "; check the folder and the space on its disk",
                        ExitCode::Output);
        }
    }
    if (std::rename(temporary.c_str(), path.c_str()) != 0)
        throw Error("cannot rename " + temporary + " to " + path, ExitCode::Output);
}

Page read_page(const std::string& path) {
    const auto broken = [&](const char* what) {
        return Error({path}, std::string("not a usable grid page: ") + what);
    };
    File f(std::fopen(path.c_str(), "rb"));
    if (!f)
        throw Error({path}, "cannot be opened");
    PageHeader h;
    if (std::fread(&h, sizeof h, 1, f.get()) != 1 || h.magic != PageMagic)
        throw broken("its header is missing");
    if (h.version != PageVersion)
        throw broken("it is of another version");
    std::fseek(f.get(), 0, SEEK_END);
    if (uint64_t(std::ftell(f.get())) != uint64_t(h.words) * 4)
        throw broken("its size differs from what its header says");
    const uint64_t order[] = {HeaderWords,    h.shapes_at,  h.tables_at,   h.inputs_at,
                              h.positions_at, h.indices_at, h.emitters_at, h.words};
    for (int i = 0; i + 1 < 8; i++)
        if (order[i] > order[i + 1])
            throw broken("its sections overlap");
    if (h.shapes_at + uint64_t(h.shapes) * ShapeWords > h.tables_at ||
        h.emitters_at + uint64_t(h.emitters) * (sizeof(Emitter) / 4) > h.words)
        throw broken("its counts do not fit");
    Page page;
    page.words.resize(h.words);
    page.header() = h;
    std::fseek(f.get(), sizeof h, SEEK_SET);
    if (std::fread(page.words.data() + HeaderWords, 4, h.words - HeaderWords, f.get()) !=
        h.words - HeaderWords)
        throw broken("it ends early");
    if (checksum(h, page) != h.checksum)
        throw broken("its checksum does not match");
    return page;
}

} // namespace kanuka::store
