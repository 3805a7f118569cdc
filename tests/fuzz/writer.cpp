// SPDX-License-Identifier: Apache-2.0
// Any values through one writer: the file has as many splats as are drawable, all of them drawable.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "input.h"
#include "support/usd_values.h"

namespace {

using namespace ewa;

/// Two bytes of choices, then float32 values; those that are missing are 0.
Gaussians scene_of(const uint8_t* data, size_t size) {
    Gaussians g;
    g.sh_degree = data[0] % 4;
    const size_t each = (11 + g.sh_stride()) * sizeof(float);
    g.resize((size - 2 + each - 1) / each);
    std::vector<float> values((size - 2) / sizeof(float) + 1);
    std::memcpy(values.data(), data + 2, size - 2);
    size_t next = 0;
    for (size_t i = 0; i < g.size(); ++i) {
        const auto fill = [&](std::vector<float>& to, size_t count) {
            for (size_t k = 0; k < count; ++k, ++next)
                to[i * count + k] = next < values.size() ? values[next] : 0;
        };
        fill(g.means, 3);
        fill(g.quaternions, 4);
        fill(g.log_scales, 3);
        fill(g.opacity_logits, 1);
        fill(g.sh, g.sh_stride());
    }
    return g;
}

/// The splats of the file, by ewa's reader if it has one.
Gaussians written(const std::filesystem::path& path) {
    if (!path.extension().string().starts_with(".usd")) return read_splats(path).gaussians;
    std::ifstream file(path, std::ios::binary);
    return test::usd_splats({std::istreambuf_iterator<char>(file), {}});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const std::filesystem::path path = fuzz::make_folder() / "a" EWA_EXTENSION;
    if (size < 2) return 0;
    const Gaussians g = scene_of(data, size);
    size_t drawn = 0;
    for (size_t i = 0; i < g.size(); ++i) drawn += drawable(g, i);
    try {
        const SaveOptions options{
            .comments = {"a", "b"}, .antialiased = (data[1] & 1) != 0, .spz_version = 3 + (data[1] >> 1 & 1)};
        save_splats(path, g, options);
    } catch (const InputError&) {
        return 0;  // values that the format has no room for
    }
    const Gaussians back = written(path);
    const bool ply = format_of_name(path) == SplatFormat::ply;
    size_t still = 0;
    for (size_t i = 0; i < back.size(); ++i) still += drawable(back, i);
    if (back.size() == (ply ? g.size() : drawn) && still == drawn) return 0;
    std::fprintf(stderr, "%zu splats, %zu drawable: %zu came back, %zu drawable\n", g.size(), drawn,
                 back.size(), still);
    std::abort();
}
