// The state of a picture on disk, so that what was stopped can go on, and parts can be joined: the pixels'
// sums as they are, how far each bucket has come, and what makes a picture of them.
//
//   magic, version │ key │ window, AOVs, buckets, pixels that may stop, first progression, bytes of the
//   record │ progressions of each bucket │ record: Development │ where pixels have stopped, bucket by bucket
//   │ sums of each bucket, block by block: pixels, AOVs │ XXH3-128 of it all
#pragma once

#include <string>
#include <vector>

#include "base/digest.h"
#include "render/accumulator.h"
#include "render/develop.h"

namespace kanuka::render {

// What a file says of itself at its beginning, which no checksum has vouched for yet.
struct CheckpointHead {
    std::string path;
    Digest key; // of the picture, of whatever part
    Window window{};
    size_t aovs = 0;
    bool stops = false;
    int first = 0, least = 0,
        most = 0; // progressions: the first, and up to which all and some buckets have come
    uint64_t bytes = 0;
};

struct Checkpoint {
    Digest key;
    Development how;
    Accumulator gathered;
    film::Picture picture() const; // throws Error where that takes the scene, or is a part of one
};

// The file appears under its name whole or not at all. Throws Error where it cannot be written.
void save_checkpoint(const std::string& path, const Digest& key, const Development& how,
                     const Accumulator& gathered);
// Throw Error where the file is damaged, or none of this version.
CheckpointHead read_checkpoint_head(const std::string& path);
Checkpoint load_checkpoint(const std::string& path);
// Fills `gathered`, which has the window and AOVs of the picture. Throws Error, and changes nothing, where
// the file is damaged, or of another picture than the one that `key` is of, or has progressions that are not
// of `part`, where that is not null.
void resume_checkpoint(const std::string& path, const Digest& key, const Part* part, Accumulator& gathered);

// Joins parts of one picture, in whatever order they are given: what one host would have that had made all of
// their progressions, bit for bit. The last one may still be under way. Throws Error where they are not of
// one picture, overlap, or where progressions between them are missing, and says which.
Checkpoint merge_checkpoints(const std::vector<std::string>& paths);

} // namespace kanuka::render
