// SPDX-License-Identifier: Apache-2.0
// Features of photos: which show the same details, which photos are compared, and COLMAP's database of them.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "capture/comparing.h"
#include "capture/feature_database.h"
#include "ewa/error.h"
#include "support/colmap_database.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using capture::Descriptors;
using capture::FeatureDatabase;
using capture::FeatureMatch;
using capture::ImagePair;
using capture::kDescriptorSize;

/// Unit directions with positive coordinates, times 512 and rounded, as SIFT's are.
Descriptors random_descriptors(size_t count, std::mt19937& random) {
    std::normal_distribution<double> normal;
    Descriptors all;
    for (size_t i = 0; i < count; ++i) {
        std::vector<double> values(kDescriptorSize);
        double squares = 0;
        for (double& value : values) {
            value = std::pow(normal(random), 2);
            squares += value * value;
        }
        for (const double value : values)
            all.push_back(std::int16_t(std::min(255.0, std::round(512 * value / std::sqrt(squares)))));
    }
    return all;
}

/// A descriptor that is a little off another one, and as long.
void add_near(Descriptors& to, const Descriptors& from, size_t place, int most, std::mt19937& random) {
    std::uniform_int_distribution<int> noise(-most, most);
    std::vector<double> values(kDescriptorSize);
    double squares = 0;
    for (size_t k = 0; k < kDescriptorSize; ++k) {
        values[k] = std::max(0, from[place * kDescriptorSize + k] + noise(random));
        squares += values[k] * values[k];
    }
    for (const double value : values)
        to.push_back(std::int16_t(std::min(255.0, std::round(512 * value / std::sqrt(squares)))));
}

/// The rules of matches_of in plain loops.
std::vector<FeatureMatch> plain_matches(const Descriptors& first, const Descriptors& second) {
    const auto nearest = [](const Descriptors& from, size_t i, const Descriptors& to) {
        double best = std::acos(0.0), next = best;
        int at = -1;
        for (size_t j = 0; j < to.size() / kDescriptorSize; ++j) {
            double product = 0;
            for (size_t k = 0; k < kDescriptorSize; ++k)
                product += double(from[i * kDescriptorSize + k]) * to[j * kDescriptorSize + k];
            const double angle = std::acos(std::min(1.0, product / (512.0 * 512.0)));
            if (angle < best) {
                next = best;
                best = angle;
                at = int(j);
            } else {
                next = std::min(next, angle);
            }
        }
        return best <= 0.7 && best < 0.8 * next ? at : -1;
    };
    std::vector<FeatureMatch> matches;
    for (size_t i = 0; i < first.size() / kDescriptorSize; ++i) {
        const int j = nearest(first, i, second);
        if (j >= 0 && nearest(second, size_t(j), first) == int(i))
            matches.push_back({uint32_t(i), uint32_t(j)});
    }
    return matches;
}

TEST(Matching, FindsWhatPlainLoopsFind) {
    std::mt19937 random(5);
    const Descriptors first = random_descriptors(61, random);
    Descriptors second = random_descriptors(40, random);
    for (size_t i = 0; i < 30; ++i) add_near(second, first, 2 * i, 4 * int(i), random);
    add_near(second, first, 0, 5, random);  // twice: the first feature has two that are as near
    const std::vector<FeatureMatch> matches = capture::matches_of(first, second);
    EXPECT_EQ(matches, plain_matches(first, second));
    EXPECT_GT(matches.size(), 15u);
    EXPECT_LT(matches.size(), 30u);
    for (const FeatureMatch& match : matches) EXPECT_EQ(match.second, 40 + match.first / 2);
}

/// A feature whose nearest is hardly nearer than the next has no match.
TEST(Matching, TakesNoFeatureThatCouldBeAnother) {
    std::mt19937 random(8);
    const Descriptors first = random_descriptors(20, random);
    Descriptors second;
    for (size_t i = 0; i < 20; ++i) {
        add_near(second, first, i, 16, random);
        if (i < 10) add_near(second, first, i, 16, random);
    }
    const std::vector<FeatureMatch> matches = capture::matches_of(first, second);
    EXPECT_EQ(matches, plain_matches(first, second));
    ASSERT_EQ(matches.size(), 10u);
    for (size_t i = 0; i < 10; ++i) EXPECT_EQ(matches[i].first, 10 + i);
}

/// Of two features with the same nearest, the one that is that one's nearest has the match.
TEST(Matching, IsMutual) {
    std::mt19937 random(9);
    Descriptors first = random_descriptors(20, random), second;
    for (size_t i = 0; i < 20; ++i) add_near(second, first, i, 4, random);
    for (size_t i = 0; i < 20; ++i) add_near(first, first, i, 14, random);
    const std::vector<FeatureMatch> matches = capture::matches_of(first, second);
    EXPECT_EQ(matches, plain_matches(first, second));
    EXPECT_GE(matches.size(), 18u);
    for (const FeatureMatch& match : matches) EXPECT_EQ(match.first, match.second);
}

TEST(Matching, NeedsFeaturesInBothImages) {
    std::mt19937 random(6);
    const Descriptors one = random_descriptors(1, random);
    EXPECT_TRUE(capture::matches_of({}, one).empty());
    EXPECT_TRUE(capture::matches_of(one, {}).empty());
    EXPECT_EQ(capture::matches_of(one, one), (std::vector<FeatureMatch>{{0, 0}}));
}

TEST(Matching, TakesTheMostAlikeOfEachImage) {
    const std::vector<ImagePair> candidates = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    // The third image shares little with any, and keeps its best. The least are too few.
    EXPECT_EQ(capture::pairs_by_look(candidates, {50, 9, 40, 8, 30, 3}, 1),
              (std::vector<ImagePair>{{0, 1}, {0, 2}, {0, 3}}));
    EXPECT_EQ(capture::pairs_by_look(candidates, {50, 9, 40, 8, 30, 3}, 2),
              (std::vector<ImagePair>{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}}));
    EXPECT_EQ(capture::pairs_by_look(candidates, {3, 3, 3, 3, 4, 3}, 2), (std::vector<ImagePair>{{1, 3}}));
    EXPECT_TRUE(capture::pairs_by_look({}, {}, 2).empty());
}

TEST(Matching, KnowsAWalksPairs) {
    EXPECT_EQ(capture::pairs_of(40, capture::Pairing::all).size(), size_t(40 * 39 / 2));
    // 10 that follow, and those 16 and 32 later.
    EXPECT_EQ(capture::pairs_of(40, capture::Pairing::in_sequence).size(), size_t(30 * 10 + 45 + 24 + 8));
}

/// Five images in a ring. Neighbours share 40 large features, and others none.
class MatchingDatabase : public testing::Test {
  protected:
    void SetUp() override {
        std::mt19937 random(7);
        const Descriptors shared = random_descriptors(5 * 40, random);
        std::vector<test::DatabaseImage> images;
        for (size_t i = 0; i < 5; ++i) {
            test::DatabaseImage image{"photo " + std::to_string(i) + ".jpg", {}, {}};
            const auto add = [&](const Descriptors& descriptors, float scale) {
                image.descriptors.insert(image.descriptors.end(), descriptors.begin(), descriptors.end());
                image.scales.insert(image.scales.end(), descriptors.size() / kDescriptorSize, scale);
            };
            add(random_descriptors(300, random), 1.5f);
            for (const size_t side : {i, (i + 1) % 5}) {
                Descriptors near;
                for (size_t k = 0; k < 40; ++k) add_near(near, shared, side * 40 + k, 3, random);
                add(near, 9);
            }
            images.push_back(image);
            names_.emplace_back(image.name);
        }
        test::write_colmap_database(file_, images);
    }

    std::optional<std::vector<ImagePair>> compare(bool by_look) {
        return capture::compare_photos(file_, names_,
                                       {.pairs = capture::pairs_of(5, capture::Pairing::all),
                                        .by_look = by_look,
                                        .pass_over_others = true},
                                       [](const auto&) { return true; });
    }

    test::TempFolder folder_;
    std::string file_ = (folder_ / "database.db").string();
    std::vector<std::filesystem::path> names_;
};

TEST_F(MatchingDatabase, GivesTheLargestFeatures) {
    const FeatureDatabase database(file_);
    EXPECT_TRUE(database.is_known());
    EXPECT_EQ(database.images().at("photo 2.jpg"), 3);
    const Descriptors all = database.descriptors(3), large = database.prominent(3, 80);
    EXPECT_EQ(all.size(), 380 * kDescriptorSize);
    EXPECT_EQ(large, Descriptors(all.end() - 80 * kDescriptorSize, all.end()));
    EXPECT_EQ(database.prominent(3, 1000).size(), all.size());
    EXPECT_TRUE(database.descriptors(9).empty());
}

TEST_F(MatchingDatabase, GetsTheMatchesOfPairsThatLookAlike) {
    EXPECT_EQ(compare(true), (std::vector<ImagePair>{{0, 1}, {0, 4}, {1, 2}, {2, 3}, {3, 4}}));
    EXPECT_TRUE(FeatureDatabase(file_).is_compared(1, 2));
    EXPECT_TRUE(FeatureDatabase(file_).is_compared(5, 1));
    EXPECT_FALSE(FeatureDatabase(file_).is_compared(1, 3));  // passed over
    // All pairs, of which some have matches.
    EXPECT_EQ(compare(false)->size(), 10u);
    EXPECT_TRUE(FeatureDatabase(file_).is_compared(2, 5));  // by `write`
}

TEST_F(MatchingDatabase, HoldsMatchesByTheLowerNumber) {
    {
        FeatureDatabase database(file_);
        database.write(4, 2, {{7, 8}, {9, 1}});
        database.pass_over(1, 2);
        database.commit();
    }
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
    sqlite3_stmt* row = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(database, "SELECT rows, data FROM matches WHERE pair_id = 4294967298", -1,
                                 &row, nullptr),
              SQLITE_OK);  // 2 * 2147483647 + 4
    ASSERT_EQ(sqlite3_step(row), SQLITE_ROW);
    EXPECT_EQ(sqlite3_column_int(row, 0), 2);
    const auto* places = static_cast<const uint32_t*>(sqlite3_column_blob(row, 1));
    EXPECT_EQ((std::vector<uint32_t>(places, places + 4)), (std::vector<uint32_t>{8, 7, 1, 9}));
    sqlite3_finalize(row);
    ASSERT_EQ(
        sqlite3_prepare_v2(database, "SELECT COUNT(*) FROM two_view_geometries WHERE pair_id = 2147483649",
                           -1, &row, nullptr),
        SQLITE_OK);
    ASSERT_EQ(sqlite3_step(row), SQLITE_ROW);
    EXPECT_EQ(sqlite3_column_int(row, 0), 1);
    sqlite3_finalize(row);
    sqlite3_close(database);
}

TEST_F(MatchingDatabase, GoesOnAfterAStop) {
    const capture::Comparison all{.pairs = capture::pairs_of(5, capture::Pairing::all)};
    EXPECT_THROW(
        capture::compare_photos(file_, names_, all, [](const auto& now) { return now.what != "matched"; }),
        capture::Stopped);
    EXPECT_EQ(compare(false)->size(), 10u);
}

TEST_F(MatchingDatabase, RefusesWhatIsNone) {
    const auto refuses = [](const std::string& file, const std::string& reason) {
        try {
            const FeatureDatabase database(file);
            if (database.is_known()) (void)database.prominent(1, 10);
            ADD_FAILURE() << file;
        } catch (const RunError& error) {
            EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
        }
    };
    refuses((folder_ / "none.db").string(), "unable to open");
    std::ofstream(folder_ / "text.db") << std::string(5000, 'x');
    refuses((folder_ / "text.db").string(), "not a database");
    std::ofstream(folder_ / "empty.db") << "";
    EXPECT_FALSE(FeatureDatabase(folder_ / "empty.db").is_known());
    test::write_colmap_database((folder_ / "short.db").string(),
                                {{"a.jpg", std::vector<std::uint8_t>(200, 1), std::vector<float>(2, 1.0f)}});
    refuses((folder_ / "short.db").string(), "an array has another size than it says");
}

}  // namespace
