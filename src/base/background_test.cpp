#include "base/background.h"

#include <atomic>
#include <chrono>
#include <vector>

#include <gtest/gtest.h>

namespace kanuka {

TEST(Background, DoesJobsInTheirOrder) {
    std::vector<int> done; // by one thread at a time
    Background background(100);
    for (int i = 0; i < 1000; i++)
        background.post(1, [&, i] { done.push_back(i); });
    background.wait();
    ASSERT_EQ(done.size(), 1000u);
    for (int i = 0; i < 1000; i++)
        EXPECT_EQ(done[size_t(i)], i);
}

TEST(Background, GoesOnWhileAJobIsAtWork) {
    std::atomic<bool> may_go = false, is_done = false;
    Background background(100);
    background.post(1, [&] {
        may_go.wait(false);
        is_done = true;
    });
    EXPECT_FALSE(is_done); // and this is reached
    may_go = true;
    may_go.notify_one();
    background.wait();
    EXPECT_TRUE(is_done);
}

TEST(Background, HoldsNoMoreThanItMay) {
    std::atomic<int> held = 0, most = 0;
    {
        Background background(10);
        for (int i = 0; i < 200; i++) {
            // Counted once there is room: whoever posts has its own beside those that wait.
            background.post(4, [&] { held -= 4; });
            held += 4;
            int seen = most;
            while (seen < held && !most.compare_exchange_weak(seen, held))
                ;
        }
        background.post(1000, [] {}); // more than ever fits: alone
    }
    EXPECT_EQ(held, 0); // all is done when it ends
    EXPECT_LE(most, 8);
}

TEST(Background, WithoutJobsThereIsNothingToWaitFor) {
    Background background(0);
    background.wait();
    background.post(0, [] {});
    background.post(7, [] {});
    background.wait();
}

} // namespace kanuka
