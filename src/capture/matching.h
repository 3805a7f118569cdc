// SPDX-License-Identifier: Apache-2.0
// Which features of two photos show the same detail, by their SIFT descriptors, and which photos are worth comparing.
#pragma once
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ewa::capture {

/// Number of values of a descriptor. Each fits into a byte, and the vector has length 512, as COLMAP writes it.
constexpr size_t kDescriptorSize = 128;

/// The descriptors of an image, [feature][kDescriptorSize]. Values have 16 bits, because CPUs multiply and add these in pairs.
using Descriptors = std::vector<std::int16_t>;

/// Two matching features, by their indices in the first and second image.
struct FeatureMatch {
    std::uint32_t first = 0, second = 0;

    bool operator==(const FeatureMatch&) const = default;
};

/// The features that are nearest to each other in both directions, in the order of the first image's. The angle between their
/// descriptors is at most 0.7, and less than 0.8 times that to the second nearest (Lowe 2004). COLMAP has the same rules.
std::vector<FeatureMatch> matches_of(const Descriptors& first, const Descriptors& second);

/// Two images by their indices, the lower first.
using ImagePair = std::pair<int, int>;

/// The candidate pairs whose images probably show the same things, in the order of the candidates. shared: the number of prominent
/// features that each pair shares (Wu 2013, preemptive matching). Each image keeps its `each` best pairs that share at least 4.
std::vector<ImagePair> pairs_by_look(const std::vector<ImagePair>& candidates, const std::vector<int>& shared,
                                     int each);

}  // namespace ewa::capture
