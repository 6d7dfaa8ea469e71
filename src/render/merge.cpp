#include <algorithm>

#include "base/error.h"
#include "render/checkpoint.h"

namespace kanuka::render {

namespace {

void check_same_picture(const CheckpointHead& one, const CheckpointHead& other) {
    if (one.key != other.key)
        throw Error(Location{other.path},
                    "the checkpoint is of another picture than " + one.path +
                        ": scene, files that it names, options and version of Kanuka have to "
                        "be the same");
    if (one.window != other.window || one.aovs != other.aovs || one.stops != other.stops)
        throw Error(Location{other.path}, "the checkpoint is damaged: its sizes are not those of " +
                                              one.path + "; render it again");
}

// `parts` in order.
void check_that_parts_follow(const std::vector<CheckpointHead>& parts) {
    for (size_t k = 0; k + 1 < parts.size(); k++) {
        const CheckpointHead &part = parts[k], &next = parts[k + 1];
        if (next.first < part.most)
            throw Error(Location{next.path}, progressions_text(next.first, std::min(part.most, next.most)) +
                                                 " are in " + part.path + " too; leave one of the two out");
        if (next.first > part.least)
            throw Error(Location{part.path},
                        progressions_text(part.least, next.first) +
                            " of the picture are missing between this and " + next.path +
                            (part.least % BlockSize ? "; this one is not finished: go on with it"
                                                    : "; render them as a part, or go on with this one"));
    }
}

} // namespace

Checkpoint merge_checkpoints(const std::vector<std::string>& paths) {
    if (paths.empty())
        throw Error("there are no checkpoints to be merged", ExitCode::Usage);
    std::vector<CheckpointHead> parts;
    for (const std::string& path : paths) {
        parts.push_back(read_checkpoint_head(path));
        check_same_picture(parts.front(), parts.back());
    }
    if (parts.size() > 1 && parts.front().stops)
        throw Error(
            Location{parts.front().path},
            "the picture is sampled adaptively: where pixels stop depends on all samples before, so it has "
            "no parts");
    // A host that was stopped before its first progression has nothing to give.
    if (std::ranges::any_of(parts, [](const CheckpointHead& p) { return p.most > p.first; }))
        std::erase_if(parts, [](const CheckpointHead& p) { return p.most == p.first; });
    std::ranges::sort(parts, {}, [](const CheckpointHead& p) { return std::pair(p.first, p.most); });
    check_that_parts_follow(parts);
    const auto load = [](const CheckpointHead& head) {
        Checkpoint part = load_checkpoint(head.path);
        if (part.key != head.key || part.gathered.first() != head.first ||
            part.gathered.least_done() != head.least || part.gathered.most_done() != head.most)
            throw Error(Location{head.path}, "the checkpoint was written while it was read; try again");
        return part;
    };
    Checkpoint all = load(parts.front());
    for (size_t k = 1; k < parts.size(); k++)
        all.gathered.append(std::move(load(parts[k]).gathered));
    return all;
}

} // namespace kanuka::render
