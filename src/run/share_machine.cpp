// SPDX-License-Identifier: Apache-2.0
#include "run/share_machine.h"

#include "gpu/choose.h"
#include "ranks/node.h"

namespace ewa::train {

void share_machine(Ranks& ranks, DeviceOptions& options) {
    if (ranks.size() == 1) return;
    const ewa::ranks::Place place = ewa::ranks::find_place(ranks);
    ewa::ranks::limit_lavapipe(place.cores);
    if (place.local_size == 1) return;
    options.selector =
        std::to_string(gpu::choose_device(list_devices(), options.selector, place.local_rank).index);
}

}  // namespace ewa::train
