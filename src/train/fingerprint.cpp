// SPDX-License-Identifier: Apache-2.0
// A hash that differs between datasets.
#include <algorithm>
#include <cstdio>

#include "core/file_reader.h"
#include "core/hash.h"
#include "train/checkpoint.h"

namespace ewa::train {
namespace {

using core::Hash;

void add_camera(Hash& hash, const Camera& camera) {
    hash.add(camera.width);
    hash.add(camera.height);
    for (const double x : {camera.fx, camera.fy, camera.cx, camera.cy}) hash.add(x);
    for (int c = 0; c < 3; ++c) {
        hash.add(camera.translation[c]);
        for (int r = 0; r < 3; ++r) hash.add(camera.rotation[c][r]);
    }
}

void add_distortion(Hash& hash, const Distortion& d) {
    hash.add(int(d.lens));
    for (const double k : {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4})
        hash.add(k);
}

/// The size and the first 64 KiB.
void add_file(Hash& hash, const std::filesystem::path& path) {
    core::FileReader file(path);
    hash.add(file.size());
    const size_t head = size_t(std::min<uint64_t>(file.size(), 1u << 16));
    hash.add(file.take(head, "the image"), head);
}

}  // namespace

std::string dataset_fingerprint(const Dataset& dataset, const Split& split) {
    Hash hash;
    for (const auto* frames : {&split.train, &split.test}) {
        hash.add(uint64_t(frames->size()));
        for (const int index : *frames) {
            const Frame& frame = dataset.frames[size_t(index)];
            hash.add(frame.name);
            add_camera(hash, frame.camera);
            add_camera(hash, frame.source);
            add_distortion(hash, frame.distortion);
            hash.add(frame.orientation);
            hash.add(int(frame.masks));
            hash.add(int(frame.mask_path.empty()));
            if (frame.image_exists) add_file(hash, frame.image_path);
            if (!frame.mask_path.empty()) add_file(hash, frame.mask_path);
        }
    }
    char text[17];
    std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(hash.value()));
    return text;
}

}  // namespace ewa::train
