// Pages that are kept within a budget, and what lies beyond a window of the store: neither changes a picture.
#include "render/page_cache.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "ingest/rib/rib.h"
#include "render/session.h"

using namespace kanuka;
using namespace kanuka::render;

namespace {

constexpr auto Any = [](const PageCache::Entry&) { return true; };

PageCache::Entry page_of(size_t words, uint64_t of_read = 0) {
    PageCache::Made made;
    made.page.words.assign(words, 0);
    made.empty = false;
    return {{}, {0, of_read}, std::make_shared<const PageCache::Made>(std::move(made))};
}

Digest name(uint64_t i) {
    return {i, i};
}

bool is_there(PageCache& pages, uint64_t i) {
    const auto entry = pages.find(name(i), Any);
    return entry && entry->made;
}

// Bytes that a page of so many words takes.
uint64_t taken(size_t words) {
    PageCache pages(true);
    pages.keep(name(0), page_of(words));
    return pages.bytes();
}

} // namespace

TEST(PageCache, WhatFindsNoRoomIsKnownAndAbsent) {
    PageCache pages(true);
    pages.set_budget(2 * taken(1000));
    for (uint64_t i = 0; i < 3; i++)
        pages.keep(name(i), page_of(1000));
    EXPECT_EQ(pages.bytes(), 2 * taken(1000));
    EXPECT_TRUE(is_there(pages, 0));
    EXPECT_TRUE(is_there(pages, 1));
    ASSERT_TRUE(pages.find(name(2), Any).has_value());
    EXPECT_FALSE(is_there(pages, 2));
    EXPECT_FALSE(pages.find(name(3), Any).has_value());
    EXPECT_FALSE(pages.find(name(0), [](const PageCache::Entry&) { return false; }).has_value());
}

// A scene larger than the budget, walked through again and again: what was kept is of use every time.
TEST(PageCache, AWalkThroughMoreThanFitsFindsWhatItKept) {
    PageCache pages(true);
    pages.set_budget(10 * taken(1000));
    for (int making = 0; making < 4; making++) {
        int found = 0;
        for (uint64_t i = 0; i < 30; i++) {
            if (is_there(pages, i))
                found++;
            else
                pages.keep(name(i), page_of(1000));
        }
        EXPECT_EQ(found, making == 0 ? 0 : 10);
        pages.next();
    }
}

TEST(PageCache, WhatWasUsedLongestAgoGoesFirst) {
    PageCache pages(true);
    pages.set_budget(3 * taken(1000));
    for (uint64_t i = 0; i < 3; i++)
        pages.keep(name(i), page_of(1000));
    pages.next();
    EXPECT_TRUE(is_there(pages, 0)); // this making uses 0 and 2
    EXPECT_TRUE(is_there(pages, 2));
    pages.next();
    EXPECT_TRUE(is_there(pages, 2)); // and this one 2
    pages.next();
    pages.keep(name(3), page_of(1000)); // in the room of 1
    pages.keep(name(4), page_of(1000)); // of 0
    pages.keep(name(5), page_of(1000)); // 2 is what the last making has used
    const bool there[] = {false, false, true, true, true, false};
    for (uint64_t i = 0; i < 6; i++)
        EXPECT_EQ(is_there(pages, i), there[i]) << i;
    EXPECT_EQ(pages.bytes(), 3 * taken(1000));
}

TEST(PageCache, WhatIsPinnedOutlivesItsEviction) {
    PageCache pages(true);
    pages.keep(name(0), page_of(1000));
    const PageCache::Pin pin = pages.find(name(0), Any)->made;
    pages.set_budget(0);
    pages.next();
    EXPECT_EQ(pages.bytes(), 0u);
    EXPECT_FALSE(is_there(pages, 0));
    EXPECT_EQ(pin->page.words.size(), 1000u);
}

TEST(PageCache, ALowerBudgetHolds) {
    PageCache pages(true);
    for (uint64_t i = 0; i < 10; i++)
        pages.keep(name(i), page_of(1000));
    pages.next();
    for (uint64_t i = 0; i < 6; i++)
        EXPECT_TRUE(is_there(pages, i));
    pages.set_budget(4 * taken(1000));
    pages.next();
    EXPECT_EQ(pages.bytes(), 4 * taken(1000));
    for (uint64_t i = 0; i < 10; i++)
        EXPECT_EQ(is_there(pages, i), i < 4) << i;
}

// One content, made in two places by shaders that read where they are.
TEST(PageCache, PlacesAreToldApart) {
    PageCache pages(true);
    pages.keep(name(0), page_of(10, 1));
    pages.keep(name(0), page_of(20, 2));
    pages.keep(name(0), page_of(30, 2)); // the same again
    for (const uint64_t of_read : {1, 2}) {
        const auto found =
            pages.find(name(0), [&](const PageCache::Entry& e) { return e.of_read.low == of_read; });
        ASSERT_TRUE(found && found->made);
        EXPECT_EQ(found->made->page.words.size(), 10 * of_read);
    }
    EXPECT_EQ(pages.bytes(), taken(10) + taken(20));
}

// ---- sessions

namespace {

class Pictures : public ::testing::Test {
  protected:
    void SetUp() override {
        m_folder = (std::filesystem::temp_directory_path() / "kanuka-pages-XXXXXX").string();
        ASSERT_NE(mkdtemp(m_folder.data()), nullptr);
        setenv("KANUKA_SHADER_CACHE", (m_folder + "/cache").c_str(), 1);
    }
    void TearDown() override { std::filesystem::remove_all(m_folder); }

    static Overrides overrides() {
        Overrides o;
        o.options.set("resolution", scene::Setting{{72, 40}, {}});
        o.options.set("samples", 2);
        o.standard_shaders = KANUKA_SOURCE_DIR "/shaders";
        return o;
    }
    static scene::Scene read(const std::string& file) {
        Journal journal;
        return ingest::read_rib(KANUKA_SOURCE_DIR "/scenes/" + file, {}, journal);
    }
    static scene::Scene read_text(const std::string& text, const std::string& name) {
        Journal journal;
        return ingest::parse_rib(text, name, {}, journal);
    }
    static void expect_same(const film::Picture& a, const film::Picture& b) {
        ASSERT_EQ(a.channels.size(), b.channels.size());
        for (size_t c = 0; c < a.channels.size(); c++)
            EXPECT_EQ(0, std::memcmp(a.channels[c].data.data(), b.channels[c].data.data(),
                                     a.channels[c].data.size() * sizeof(float)))
                << a.channels[c].name;
    }
    std::string m_folder;
};

} // namespace

TEST_F(Pictures, AreTheSameForAnyWindowOfTheStore) {
    for (const char* file : {"shapes.rib", "solids.rib"})
        for (const int lanes : {0, 1}) {
            const scene::Scene scene = read(file);
            Overrides o = overrides();
            o.lanes = lanes;
            Journal journal;
            Stats stats;
            const Result whole = render::render(scene, o, journal, stats, {});
            const uint64_t bytes = stats.bytes.grids + stats.bytes.lobe_inputs;
            // As small as the largest page lets it be.
            std::optional<Result> parted;
            for (size_t words = 1 << 10; !parted; words *= 2)
                try {
                    Stats again;
                    o.store_window = words;
                    parted = render::render(scene, o, journal, again, {});
                } catch (const Error& error) {
                    ASSERT_NE(std::string(error.what()).find("is more than"), std::string::npos)
                        << error.what();
                }
            EXPECT_GT(bytes, o.store_window * 4) << file; // in several
            expect_same(whole.picture, parted->picture);
        }
}

// Things that move as a whole, one by one and as instances.
constexpr const char* Moving = R"(
Shutter 0 1
Projection "perspective" "fov" 28
Translate 0 0 6
WorldBegin
LightSource "ambientlight" 1 "intensity" 0.3
LightSource "distantlight" 2 "from" [-3 6 -5] "to" [0 0 0] "intensity" 0.8
Surface "matte"
Polygon "P" [-9 -1.5 -4  9 -1.5 -4  9 -1.5 9  -9 -1.5 9]
ObjectBegin 1
  Color [0.8 0.4 0.2]
  Sphere 0.5 -0.5 0.5 360
  Translate 0.7 0 0
  Scale 0.5 0.2 0.6
  Sphere 0.5 -0.5 0.5 360
ObjectEnd
AttributeBegin
  MotionBegin [0 1] Translate -1.5 0.5 0 Translate -0.5 0.9 0 MotionEnd
  MotionBegin [0 0.5 1] Rotate 0 0 0 1 Rotate 100 0 1 1 Rotate 220 0 1 1 MotionEnd
  ObjectInstance 1
AttributeEnd
AttributeBegin
  Translate 1.5 -0.6 0
  MotionBegin [0 1] Scale 1 1 1 Scale 1.6 1 -1 MotionEnd
  ObjectInstance 1
AttributeEnd
AttributeBegin
  Color [0.3 0.5 0.8]
  MotionBegin [0 1] Translate -1 -0.9 0 Translate 0.4 -0.7 -1 MotionEnd
  Torus 0.4 0.15 0 360 360
AttributeEnd
WorldEnd
)";

// Small scenes, all of whose groups lie in pages of our own hierarchy: the same bits for any lanes and
// threads. Embree's picture has the same random numbers and other roundings: paths that part from it cancel
// out, pixel by pixel they are few.
TEST_F(Pictures, OfPagesHaveTheSameBitsAndShowWhatEmbreesShow) {
    for (const std::string file : {"shapes.rib", "solids.rib", "listings.rib", "volumes.rib", "moving"}) {
        const scene::Scene scene = file == "moving" ? read_text(Moving, file) : read(file);
        Overrides o = overrides();
        Journal journal;
        Stats stats;
        const Result embree = render::render(scene, o, journal, stats, {});
        o.pages_from = 0;
        const Result pages = render::render(scene, o, journal, stats, {});
        for (const int lanes : {1, 16}) {
            Overrides other = o;
            other.lanes = lanes, other.threads = lanes == 1 ? 3 : 1;
            expect_same(pages.picture, render::render(scene, other, journal, stats, {}).picture);
        }
        double sum = 0, difference = 0;
        size_t apart = 0, pixels = 0;
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < pages.picture.channels[c].data.size(); i++) {
                const double a = double(embree.picture.channels[c].data[i]),
                             b = double(pages.picture.channels[c].data[i]);
                sum += a, difference += b - a;
                apart += std::abs(a - b) > 0.02 * (std::abs(a) + std::abs(b)) + 1e-4;
                pixels++;
            }
        EXPECT_LT(std::abs(difference), 0.01 * sum) << file;     // 0.002 at most
        EXPECT_LT(double(apart), 0.02 * double(pixels)) << file; // 0.004
    }
}

TEST_F(Pictures, AreTheSameForAnyPageMemory) {
    scene::Scene scene = read("shapes.rib");
    Journal journal;
    uint64_t all = 0, evicted_of_one_thread = 0;
    for (const double part : {2.0, 0.4, 0.0})
        for (const int threads : {1, 3}) {
            Overrides o = overrides();
            o.threads = threads;
            if (all > 0)
                o.page_memory = uint64_t(part * double(all));
            Stats stats, again, fresh_stats;
            Session session(scene, o, Session::Keep::Pages, journal, stats);
            session.advance(2, {});
            all = stats.bytes.grids + stats.bytes.lobe_inputs;
            o.options.set("max_depth", 2);
            session.update(o, again);
            session.advance(2, {});
            const uint64_t kept = again.count.primitives_kept, evicted = again.count.primitives_evicted;
            EXPECT_EQ(kept + evicted, again.count.primitives);
            if (part == 2)
                EXPECT_EQ(evicted, 0u);
            else
                EXPECT_GT(evicted, 0u);
            EXPECT_EQ(kept == 0, part == 0);
            if (threads == 1)
                evicted_of_one_thread = evicted;
            EXPECT_EQ(evicted, evicted_of_one_thread);
            EXPECT_EQ(again.count.hierarchies_kept, 1u);
            expect_same(session.picture(), render::render(scene, o, journal, fresh_stats, {}).picture);
        }
}

// The geometry of before is kept for a hierarchy that may be the same, unless both together are too much.
TEST_F(Pictures, WhatLeavesNoRoomIsDropped) {
    const scene::Scene scene = read("shapes.rib");
    Journal journal;
    for (const bool scarce : {false, true}) {
        Overrides o = overrides();
        o.shading_rate = 0.02f;
        Stats stats, again;
        Session session(scene, o, Session::Keep::Pages, journal, stats);
        session.advance(1, {});
        if (scarce)
            o.memory = 7 * (stats.bytes.grids + stats.bytes.lobe_inputs);
        session.update(o, again);
        session.advance(1, {});
        EXPECT_EQ(again.count.hierarchies_kept, scarce ? 0u : 1u);
    }
}
