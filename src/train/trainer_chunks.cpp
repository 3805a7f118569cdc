// SPDX-License-Identifier: Apache-2.0
// What a trainer does with splats that are in chunks, and the same for splats that are all on the device.
#include <algorithm>
#include <utility>

#include "pipeline/share.h"
#include "train/state_stream.h"
#include "train/trainer_state.h"

namespace ewa {

using namespace pipeline;
using train::Chunks;

void Trainer::State::divide(const Gaussians& ready, int count) {
    const uint32_t all = uint32_t(ready.size());
    check_share(all, count);
    chunks.emplace(*device, count, options.device_memory_bytes);
    model.sh_degree = ready.sh_degree;
    model.origin = ready.origin;
    for (int chunk = 0; chunk < count; ++chunk) {
        const Range range = range_of(all, chunk, count);
        Model made = upload_model(*device, slice_of(ready, range.first, range.splats), plan.moment_buffers(),
                                  plan.statistics);
        made.share = {alone(), range.first, all};
        chunks->set(chunk, std::move(made));
    }
    // The first frame tells how many there are. A capacity for all splats might not fit.
    instance_capacity = first_capacity(0);
}

void Trainer::State::refine(const std::function<void(Model&)>& refine) {
    if (!chunks) {
        frame.free_instances();  // the second copy of an array takes its place
        refine(model);
        return;
    }
    // A value a splat of any chunk, and no picture: with mcmc one chunk holds all new splats until the chunks are level.
    frame = {};
    frame.reserve(*device, cache.config(),
                  {.splats = chunks->largest(), .width = 1, .height = 1, .instances = 1});
    chunks->together([&](Model& chunk) {
        refine(chunk);
        model.share.all = chunk.share.all;
    });
    frame = {};
}

void Trainer::State::change(const std::function<void(gpu::Recording&, const Model&)>& change) {
    const auto run = [&](const Model& of) {
        gpu::Recording recording(device->limits());
        change(recording, of);
        executor.run(recording);
    };
    if (!chunks) {
        run(model);
        return;
    }
    chunks->visit(Chunks::Need::state, [&](int, const Model& chunk) {
        run(chunk);
        chunks->changed();
    });
}

uint64_t Trainer::State::state_bytes() const {
    return (1 + uint64_t(plan.moment_buffers())) * parameter_bytes(model.share.all, model.sh_degree) +
           (plan.statistics ? 8ull * model.share.all : 0);
}

std::vector<TrainerArray> Trainer::State::chunk_arrays() {
    std::vector<TrainerArray> joined;
    const auto add = [&](const char* name, Chunks::Array array, const auto& bytes_of) {
        joined.push_back({name, chunks->joined(array, bytes_of)});
    };
    const auto of_parameters = [&](uint32_t splats) { return parameter_bytes(splats, model.sh_degree); };
    add("params", Chunks::params, of_parameters);
    add("moments1", Chunks::moments1, of_parameters);
    if (plan.moment_buffers() > 1) add("moments2", Chunks::moments2, of_parameters);
    if (plan.statistics) add("statistics", Chunks::statistics, [](uint32_t splats) { return 8ull * splats; });
    return joined;
}

void Trainer::State::set_chunk_arrays(train::StateReader& from) {
    const uint32_t all = from.head().report.splats;
    check_share(all, chunks->count());
    for (int chunk = 0; chunk < chunks->count(); ++chunk) {
        const Range range = range_of(all, chunk, chunks->count());
        Model made;
        made.splats = made.capacity = range.splats;
        made.sh_degree = model.sh_degree;
        made.origin = model.origin;
        made.share = {alone(), range.first, all};
        chunks->set(chunk, std::move(made));
        for (size_t i = 0; i < from.arrays().size(); ++i) {
            const std::string& name = from.arrays()[i].name;
            const auto give = [&](Chunks::Array array, gpu::Texel texel, uint64_t first, uint64_t size) {
                std::vector<std::byte> bytes(size);
                from.read(i, first, bytes);
                chunks->give(chunk, array, texel, bytes);
            };
            const uint64_t first = range.first > 0 ? parameter_bytes(range.first, model.sh_degree) : 0;
            const uint64_t size = parameter_bytes(range.splats, model.sh_degree);
            if (name == "params") give(Chunks::params, gpu::Texel::rgba32f, first, size);
            if (name == "moments1") give(Chunks::moments1, gpu::Texel::rgba32ui, first, size);
            if (name == "moments2") give(Chunks::moments2, gpu::Texel::rgba32ui, first, size);
            if (name == "statistics")
                give(Chunks::statistics, gpu::Texel::none, 8ull * range.first, 8ull * range.splats);
        }
    }
}

std::optional<ChunkFigures> Trainer::chunk_figures() const {
    const State& s = *state_;
    if (!s.chunks) return {};
    const double steps = std::max(1.0, double(s.times.steps) / s.options.batch);
    return ChunkFigures{s.chunks->count(), double(s.chunks->streamed_bytes()) / steps,
                        s.chunks->streaming() / steps, s.state_bytes(), s.options.device_memory_bytes};
}

}  // namespace ewa
