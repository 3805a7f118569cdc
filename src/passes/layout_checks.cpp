// SPDX-License-Identifier: Apache-2.0
// Host and shader see the same bytes: the scalar block layout packs these structs without padding, and so
// does C++.
#include "shared/layouts.h"

namespace ewa::shared {

static_assert(sizeof(CameraBlock) == 4 * (9 + 9 + 3 + 3 + 8 + 4 + 4));
static_assert(offsetof(CameraBlock, size) == 4 * (9 + 9 + 3 + 3 + 8 + 4));
static_assert(sizeof(Counts) == 32 && offsetof(Counts, l1) == 16);
static_assert(sizeof(ProjectPush) == 12 && sizeof(SortPush) == 16 && sizeof(ScanPush) == 8);
static_assert(sizeof(ScanTotalsPush) == 8 && sizeof(EmitPush) == 32 && sizeof(TileStartsPush) == 8);
static_assert(sizeof(BlendPush) == 48 && offsetof(BlendPush, capacity) == 44);
static_assert(sizeof(UnpackPush) == 28 && sizeof(LossPush) == 24 && sizeof(ReducePush) == 16);
static_assert(sizeof(MaskPush) == 16 && sizeof(PackPush) == 4 && sizeof(ExposurePush) == 20 &&
              sizeof(ExposureUpdatePush) == 28);
static_assert(sizeof(UpdatePush) == 60 && sizeof(DensifyPush) == 48 && sizeof(ResetPush) == 12);
static_assert(sizeof(McmcPush) == 56 && sizeof(PerturbPush) == 32);
static_assert(sizeof(TraceView) == 4 * (9 + 3 + 2 + 2 + 2 + 9 + 1) && sizeof(TraceCounts) == 8 &&
              sizeof(TracePush) == 24);

}  // namespace ewa::shared
