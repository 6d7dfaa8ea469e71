// Transforms, bounds, threads, errors and the journal.
#include <atomic>
#include <gtest/gtest.h>
#include <random>
#include <thread>

#include "base/error.h"
#include "base/shared_value.h"
#include "base/tasks.h"
#include "base/vec.h"

namespace kanuka {
namespace {

Transform random_transform(std::mt19937& g) {
    std::uniform_real_distribution<double> u(-1, 1);
    return Transform::translate(10 * u(g), 10 * u(g), 10 * u(g)) *
           Transform::rotate(180 * u(g), u(g), u(g), u(g)) *
           Transform::scale(std::exp(u(g)), std::exp(u(g)), -std::exp(u(g)));
}

float distance(const Vec3f& a, const Vec3f& b) {
    return length(a - b);
}

} // namespace

TEST(Transform, RotatesByTheRightHandRule) {
    const Transform z = Transform::rotate(90, 0, 0, 5);
    EXPECT_LT(distance(z.point({1, 0, 0}), {0, 1, 0}), 1e-6f);
    EXPECT_LT(distance(z.point({0, 1, 0}), {-1, 0, 0}), 1e-6f);
    EXPECT_LT(distance(Transform::rotate(90, 1, 0, 0).point({0, 1, 0}), {0, 0, 1}), 1e-6f);
    EXPECT_LT(distance(Transform::rotate(120, 1, 1, 1).point({1, 2, 3}), {3, 1, 2}), 1e-6f);
    EXPECT_EQ(Transform::rotate(90, 0, 0, 0), Transform()); // no axis, no turn
}

TEST(Transform, ProductsApplyRightToLeft) {
    const Transform t = Transform::translate(1, 2, 3) * Transform::scale(2, 2, 2);
    EXPECT_EQ(t.point({1, 1, 1}), Vec3f(3, 4, 5));
    EXPECT_EQ(t.vector({1, 1, 1}), Vec3f(2, 2, 2));
    EXPECT_EQ(t.determinant3(), 8);
}

TEST(Transform, InverseUndoes) {
    std::mt19937 g(1);
    std::uniform_real_distribution<float> u(-5, 5);
    for (int i = 0; i < 200; i++) {
        const Transform t = random_transform(g), inverse = t.inverse();
        const Vec3f p(u(g), u(g), u(g));
        EXPECT_LT(distance(inverse.point(t.point(p)), p), 1e-5f);
        EXPECT_LT(t.determinant3(), 0); // one axis is mirrored
        const Transform identity = t * inverse;
        for (int r = 0; r < 4; r++)
            for (int c = 0; c < 4; c++)
                EXPECT_NEAR(identity.m[r][c], r == c, 1e-12);
    }
}

TEST(Transform, NormalsStayPerpendicular) {
    std::mt19937 g(2);
    std::uniform_real_distribution<float> u(-1, 1);
    for (int i = 0; i < 200; i++) {
        const Transform t = random_transform(g);
        const Vec3f a(u(g), u(g), u(g)), b(u(g), u(g), u(g));
        const Vec3f n = normalize(t.normal(cross(a, b), t.inverse()));
        EXPECT_LT(std::abs(dot(n, normalize(t.vector(a)))), 1e-5f);
        EXPECT_LT(std::abs(dot(n, normalize(t.vector(b)))), 1e-5f);
    }
}

TEST(Transform, ProjectiveMatricesDivide) {
    Transform t;
    t.m[3] = {0, 0, 1, 0};
    EXPECT_EQ(t.point({2, 4, 2}), Vec3f(1, 2, 1));
}

TEST(Transform, SingularOnesSayWhatToCheck) {
    for (const Transform& t :
         {Transform::scale(1, 0, 1), Transform::translate(1, 2, 3) * Transform::scale(0, 0, 0),
          Transform::rotate(30, 1, 2, 3) * Transform::scale(1, 0, 1)}) {
        try {
            t.inverse();
            FAIL() << "a singular transform was inverted";
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find("scale of zero"), std::string::npos) << e.what();
        }
    }
    // Small or stretched is not singular.
    const Transform thin =
        Transform::rotate(30, 1, 2, 3) * Transform::scale(1e-6, 1e-9, 1e3) * Transform::translate(1e6, 0, 0);
    EXPECT_NO_THROW(thin.inverse());
    EXPECT_NO_THROW(Transform::scale(1e-20, 1e-20, 1e-20).inverse());
}

TEST(Bounds, GrowAndKnowTheirMiddle) {
    Bounds3f b;
    EXPECT_TRUE(b.empty());
    b.extend(Vec3f(1, 2, 3));
    EXPECT_FALSE(b.empty());
    b.extend(Vec3f(-1, 4, 3));
    EXPECT_EQ(b.center(), Vec3f(0, 3, 3));
    EXPECT_EQ(b.diagonal(), Vec3f(2, 2, 0));
    b.extend(Bounds3f()); // nothing
    EXPECT_EQ(b.diagonal(), Vec3f(2, 2, 0));
}

TEST(Tasks, EveryIndexRunsOnce) {
    for (int threads : {1, 2, 4}) {
        std::vector<std::atomic<int>> runs(1000);
        tasks::with_threads(threads, [&] {
            EXPECT_EQ(tasks::max_threads(), threads);
            tasks::parallel_for(runs.size(), [&](size_t i) { runs[i]++; });
        });
        for (const auto& r : runs)
            ASSERT_EQ(r.load(), 1);
    }
    tasks::parallel_for(0, [](size_t) { FAIL() << "nothing was asked for"; });
}

TEST(Tasks, ChunksDoNotDependOnThreads) {
    const auto chunks = [](int threads, size_t count, size_t grain) {
        std::mutex mutex;
        std::vector<std::pair<size_t, size_t>> all;
        tasks::with_threads(threads, [&] {
            tasks::parallel_chunks(count, grain, [&](size_t begin, size_t end) {
                std::lock_guard lock(mutex);
                all.emplace_back(begin, end);
            });
        });
        std::sort(all.begin(), all.end());
        return all;
    };
    for (const auto& [count, grain] :
         {std::pair<size_t, size_t>{1000, 64}, {64, 64}, {1, 64}, {0, 64}, {65, 64}}) {
        const auto one = chunks(1, count, grain);
        EXPECT_EQ(one, chunks(3, count, grain));
        size_t at = 0;
        for (const auto& [begin, end] : one) {
            EXPECT_EQ(begin, at);
            EXPECT_LE(end - begin, grain);
            at = end;
        }
        EXPECT_EQ(at, count);
    }
}

TEST(Tasks, ExceptionsReachTheCaller) {
    const auto work = [] {
        tasks::with_threads(2, [] {
            tasks::parallel_for(100, [](size_t i) {
                if (i == 57)
                    throw Error("fifty-seven");
            });
        });
    };
    EXPECT_THROW(work(), Error);
}

// Millions of locations name the same file.
TEST(Location, NamesAreKeptOnce) {
    static_assert(sizeof(Location) == 16 && std::is_trivially_copyable_v<Location>);
    const std::string path = "a/path/longer/than/a/string/holds/in/itself.rib";
    const FileName a(path), b(std::string_view(path).substr(0)), other("b.rib");
    EXPECT_EQ(&a.str(), &b.str());
    EXPECT_EQ(a, path);
    EXPECT_NE(a, other);
    EXPECT_LT(a, other); // by their text, not by when they were named
    EXPECT_LT(FileName(), a);
    EXPECT_TRUE(FileName().empty());
    EXPECT_TRUE(FileName("").empty());
    EXPECT_EQ(FileName().str(), "");
}

TEST(Shared, CopiesShareAndReplacingLeavesThem) {
    Shared<std::array<int, 2>> a, b = std::array{1, 2};
    EXPECT_EQ((*a)[0], 0);
    a = b;
    EXPECT_EQ(&*a, &*b);
    b = std::array{1, 2};
    EXPECT_NE(&*a, &*b);
    EXPECT_EQ(a, b);
    b = std::array{1, 3};
    EXPECT_EQ((*a)[1], 2);
    EXPECT_FALSE(a == b);
}

TEST(Errors, SayWhere) {
    EXPECT_EQ(Location().str(), "");
    EXPECT_EQ((Location{"a.rib"}).str(), "a.rib");
    EXPECT_EQ((Location{"a.rib", 3}).str(), "a.rib:3");
    EXPECT_EQ((Location{"a.rib", 3, 9}).str(), "a.rib:3:9");
    EXPECT_EQ((Location{"a.rib", 0, 9}).str(), "a.rib"); // a column means nothing without its line
    const Error e({"a.rib", 3, 9}, "no such thing", ExitCode::Output);
    EXPECT_STREQ(e.what(), "a.rib:3:9: no such thing");
    EXPECT_EQ(e.where().line, 3);
    EXPECT_EQ(e.code(), ExitCode::Output);
    EXPECT_STREQ(Error("plain").what(), "plain");
    EXPECT_EQ(Error("plain").code(), ExitCode::Input);
}

TEST(Journal, CountsRepeatsAndSorts) {
    Journal journal;
    EXPECT_FALSE(journal.has_errors());
    journal.warning({"b.rib", 2}, "w");
    journal.error({"a.rib", 9}, "later");
    journal.error({"a.rib", 1}, "first");
    for (int i = 0; i < 3; i++)
        journal.warning({"b.rib", 2}, "w");
    const auto entries = journal.entries();
    ASSERT_EQ(entries.size(), 3u);
    EXPECT_EQ(entries[0].message, "first");
    EXPECT_EQ(entries[1].message, "later");
    EXPECT_EQ(entries[2].count, 4u);
    EXPECT_EQ(entries[2].severity, Severity::Warning);
    EXPECT_EQ(journal.error_count(), 2u);
    EXPECT_TRUE(journal.has_errors());
}

TEST(Journal, SameFromAnyThread) {
    const auto fill = [](int threads) {
        Journal journal;
        std::vector<std::thread> pool;
        for (int t = 0; t < threads; t++)
            pool.emplace_back([&, t] {
                for (int i = t; i < 400; i += threads)
                    journal.report(i % 3 ? Severity::Warning : Severity::Error, {"f", i % 10},
                                   "m" + std::to_string(i % 7));
            });
        for (auto& t : pool)
            t.join();
        std::string text;
        for (const auto& e : journal.entries())
            text += std::to_string(int(e.severity)) + e.where.str() + e.message + " x" +
                    std::to_string(e.count) + "\n";
        return text;
    };
    EXPECT_EQ(fill(1), fill(4));
}

TEST(Journal, ListenerHearsNewEntriesOnly) {
    Journal journal;
    int heard = 0;
    journal.set_listener([](const Journal::Entry&, void* user) { ++*static_cast<int*>(user); }, &heard);
    for (int i = 0; i < 5; i++)
        journal.warning({}, "again");
    journal.warning({}, "other");
    EXPECT_EQ(heard, 2);
}

} // namespace kanuka
