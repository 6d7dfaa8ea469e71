// Dicing one primitive.
#pragma once

#include <gtest/gtest.h>

#include "dice/test_scene.h"

namespace kanuka::dice::test {

// Without a journal nothing may be reported.
inline Diced run(const scene::Primitive& p, const DiceOptions& o, const Displace& displace = {},
                 DiceTarget target = {}, Journal* journal = nullptr) {
    Journal own;
    Diced d = dice::dice(p, target, o, displace, journal ? *journal : own);
    if (!journal) {
        EXPECT_TRUE(own.entries().empty()) << own.entries()[0].message;
    }
    return d;
}

} // namespace kanuka::dice::test
