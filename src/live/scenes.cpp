// SPDX-License-Identifier: Apache-2.0
#include "live/scenes.h"

#include <vector>

#include "io/splats/format_table.h"
#include "io/splats/formats.h"
#include "io/splats/prepare.h"

namespace ewa::live {
namespace {

constexpr int kRest = 4;  // times as long as making the scene before took

std::string packed_scene(const Gaussians& gaussians, const SaveOptions& options) {
    std::vector<std::string> remarks;
    const io::FormatRow& row = io::row_of(SplatFormat::sog);
    if (io::is_prepared(gaussians, row)) return io::pack_sog("the scene", gaussians, options, remarks);
    Gaussians changed = gaussians;
    io::prepare(changed, row);
    return io::pack_sog("the scene", changed, options, remarks);
}

}  // namespace

std::shared_ptr<const Scene> Scenes::kept(bool trusted, bool busy) {
    const std::lock_guard lock(mutex_);
    const auto given = given_.lock();
    if (!trusted && given && given != last_) return given;
    if (!last_ || !busy || Clock::now() >= next_) return nullptr;
    if (!trusted) given_ = last_;
    return last_;
}

std::shared_ptr<const Scene> Scenes::of(const Version& version, const Gaussians& gaussians,
                                        const SaveOptions& options, bool trusted, bool busy) {
    const std::lock_guard making(making_);
    // Another request may have made one in the meantime.
    if (const auto scene = kept(trusted, busy)) return scene;
    const bool newer =
        !last_ || static_cast<const Version&>(*last_) < version;  // only who holds making_ changes it
    const Clock::time_point start = Clock::now();
    auto scene =
        newer ? std::make_shared<const Scene>(Scene{version, packed_scene(gaussians, options)}) : last_;
    const std::lock_guard lock(mutex_);
    last_ = std::move(scene);
    if (newer) next_ = Clock::now() + kRest * (Clock::now() - start);
    if (!trusted) given_ = last_;
    return last_;
}

}  // namespace ewa::live
