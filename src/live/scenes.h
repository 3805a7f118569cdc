// SPDX-License-Identifier: Apache-2.0
// The splats of a run as the page reads them: a SOG (io/splats/sog.h), made when somebody asks for it.
#pragma once
#include <chrono>
#include <compare>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "ewa/gaussians.h"
#include "ewa/splat_scene.h"

namespace ewa::live {

/// The splats that a scene is of: the step of the training, and the edits before them.
struct Version {
    int step = 0;
    uint64_t edits = 0;
    auto operator<=>(const Version&) const = default;
};

struct Scene : Version {
    std::string sog;
};

/// Safe to use from several threads. Requests without the token get one scene, as long as any of them reads it.
class Scenes {
  public:
    /// The last scene if no newer one may be made now, else null. busy: the training runs. Making scenes then takes at
    /// most a fifth of the time.
    std::shared_ptr<const Scene> kept(bool trusted, bool busy);
    /// The scene of these splats, or of later ones. Returns late while another scene is made.
    std::shared_ptr<const Scene> of(const Version& version, const Gaussians& gaussians,
                                    const SaveOptions& options, bool trusted, bool busy);

  private:
    using Clock = std::chrono::steady_clock;

    std::mutex making_;  // is locked first
    std::mutex mutex_;   // of what follows
    std::shared_ptr<const Scene> last_;
    std::weak_ptr<const Scene> given_;  // to those without the token
    Clock::time_point next_;
};

}  // namespace ewa::live
