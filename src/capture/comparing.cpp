// SPDX-License-Identifier: Apache-2.0
#include "capture/comparing.h"

#include <algorithm>
#include <atomic>
#include <set>

#include "capture/feature_database.h"
#include "core/text.h"

namespace ewa::capture {
namespace {

constexpr size_t kProminent = 256;  // features of a photo that say whether another one is worth comparing
constexpr int kEach = 12;           // photos that one is compared with, by look

constexpr int kSequence = 10;  // photos that follow, of a sequence
constexpr int kFarthest = 512;
constexpr int kLasting = 200;  // pairs, after which a killed search need not begin again

using PairPlaces = std::vector<ImagePair>;

/// How many prominent features the photos of each pair share.
std::vector<int> shared_features(const FeatureDatabase& database, const std::vector<std::int64_t>& images,
                                 const PairPlaces& pairs, const ProgressFunction& progress) {
    std::vector<Descriptors> prominent(images.size());
    on_all_cores({CapturePhase::matches, "read", "images", 0, int(images.size()), {}}, progress,
                 [&](size_t i) { prominent[i] = database.prominent(images[i], kProminent); });
    std::vector<int> shared(pairs.size());
    on_all_cores({CapturePhase::matches, "looked at", "pairs", 0, int(pairs.size()), {}}, progress,
                 [&](size_t i) {
                     const auto [a, b] = pairs[i];
                     shared[i] = int(matches_of(prominent[size_t(a)], prominent[size_t(b)]).size());
                 });
    return shared;
}

}  // namespace

std::vector<ImagePair> pairs_of(int photos, Pairing pairing) {
    std::vector<ImagePair> pairs;
    for (int a = 0; a < photos; ++a)
        for (int b = a + 1; b < photos; ++b) {
            const int apart = b - a;
            if (pairing != Pairing::in_sequence || apart <= kSequence ||
                (apart <= kFarthest && (apart & (apart - 1)) == 0))
                pairs.emplace_back(a, b);
        }
    return pairs;
}

std::optional<std::vector<ImagePair>> compare_photos(const std::filesystem::path& file,
                                                     const std::vector<std::filesystem::path>& names,
                                                     const Comparison& comparison,
                                                     const ProgressFunction& progress) {
    FeatureDatabase database(file);
    if (!database.is_known()) return {};
    const auto numbers = database.images();
    std::vector<std::int64_t> images;  // 0: none
    for (const std::filesystem::path& name : names) {
        const auto found = numbers.find(name.string());
        images.push_back(found == numbers.end() ? 0 : found->second);
    }
    PairPlaces pairs = comparison.pairs;
    if (comparison.by_look) {
        pairs = pairs_by_look(pairs, shared_features(database, images, pairs, progress), kEach);
        pairs.insert(pairs.end(), comparison.always.begin(), comparison.always.end());
        std::ranges::sort(pairs);
        pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    }
    const auto has_features = [&](const ImagePair& pair) {
        return images[size_t(pair.first)] != 0 && images[size_t(pair.second)] != 0;
    };
    std::erase_if(pairs, [&](const ImagePair& pair) { return !has_features(pair); });
    const auto numbers_of = [&](const ImagePair& pair) {
        return std::pair(images[size_t(pair.first)], images[size_t(pair.second)]);
    };
    std::vector<ImagePair> left;  // of a search that was interrupted
    std::ranges::copy_if(pairs, std::back_inserter(left), [&](const ImagePair& pair) {
        const auto [a, b] = numbers_of(pair);
        return !database.is_compared(a, b);
    });
    std::atomic<int> written = 0;
    const auto compare = [&](size_t i) {
        const auto [a, b] = numbers_of(left[i]);
        database.write(a, b, matches_of(database.descriptors(a), database.descriptors(b)));
        if (++written % kLasting == 0) database.commit();
    };
    try {
        const int done = int(pairs.size() - left.size());
        on_all_cores({CapturePhase::matches, "matched", "pairs", done, int(pairs.size()), {}}, progress,
                     compare);
    } catch (const Stopped&) {
        database.commit();
        throw;
    }
    if (comparison.pass_over_others) {
        std::set<std::pair<std::int64_t, std::int64_t>> compared;
        for (const auto& [a, b] : pairs) compared.insert(std::minmax({images[size_t(a)], images[size_t(b)]}));
        std::vector<std::int64_t> all;
        for (const auto& [name, image] : numbers) all.push_back(image);
        std::ranges::sort(all);
        for (size_t a = 0; a < all.size(); ++a)
            for (size_t b = a + 1; b < all.size(); ++b)
                if (!compared.contains({all[a], all[b]})) database.pass_over(all[a], all[b]);
    }
    database.commit();
    return pairs;
}

}  // namespace ewa::capture
