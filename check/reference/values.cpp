// SPDX-License-Identifier: Apache-2.0
#include "reference/values.h"

#include <algorithm>
#include <cassert>

#include "scene/splat_arrays.h"

namespace ewa::reference {

void Values::resize(size_t n) {
    means.resize(3 * n);
    quaternions.resize(4 * n);
    log_scales.resize(3 * n);
    opacity_logits.resize(n);
    sh.resize(n * sh_stride());
}

Values::Values(const Gaussians& g)
    : sh_degree(g.sh_degree),
      means(g.means.begin(), g.means.end()),
      quaternions(g.quaternions.begin(), g.quaternions.end()),
      log_scales(g.log_scales.begin(), g.log_scales.end()),
      opacity_logits(g.opacity_logits.begin(), g.opacity_logits.end()),
      sh(g.sh.begin(), g.sh.end()) {
    for (size_t i = 0; i < means.size(); ++i) means[i] += g.origin[int(i % 3)];
    for (double& value : log_scales) value = scene::computable_log_scale(float(value));
    for (double& value : opacity_logits) value = scene::computable_logit(float(value));
}

Values zeros_like(const Values& values) {
    Values zeros;
    zeros.sh_degree = values.sh_degree;
    zeros.resize(values.size());
    return zeros;
}

namespace {

template <class Scene>
Splat read(const Scene& scene, size_t i) {
    assert(i < scene.size());
    Splat splat;
    for (int k = 0; k < 3; ++k) splat.mean[k] = scene.means[3 * i + k];
    for (int k = 0; k < 4; ++k) splat.quaternion[k] = scene.quaternions[4 * i + k];
    for (int k = 0; k < 3; ++k) splat.log_scale[k] = scene.log_scales[3 * i + k];
    splat.opacity_logit = scene.opacity_logits[i];
    splat.sh_degree = scene.sh_degree;
    for (int j = 0; j < sh_coefficients(scene.sh_degree); ++j)
        for (int k = 0; k < 3; ++k) splat.sh[j][k] = scene.sh[i * scene.sh_stride() + 3 * j + k];
    return splat;
}

}  // namespace

Splat read_splat(const Gaussians& gaussians, size_t i) {
    Splat splat = read(gaussians, i);
    splat.mean += gaussians.origin;
    for (int k = 0; k < 3; ++k) splat.log_scale[k] = scene::computable_log_scale(float(splat.log_scale[k]));
    splat.opacity_logit = scene::computable_logit(float(splat.opacity_logit));
    return splat;
}
Splat read_splat(const Values& values, size_t i) {
    return read(values, i);
}

void write_splat(Values& values, size_t i, const Splat& splat) {
    assert(i < values.size());
    for (int k = 0; k < 3; ++k) values.means[3 * i + k] = splat.mean[k];
    for (int k = 0; k < 4; ++k) values.quaternions[4 * i + k] = splat.quaternion[k];
    for (int k = 0; k < 3; ++k) values.log_scales[3 * i + k] = splat.log_scale[k];
    values.opacity_logits[i] = splat.opacity_logit;
    for (int j = 0; j < sh_coefficients(values.sh_degree); ++j)
        for (int k = 0; k < 3; ++k) values.sh[i * values.sh_stride() + 3 * j + k] = splat.sh[j][k];
}

Raster to_double(const Image& image) {
    assert(image.channels != 2);
    Raster raster(image.width, image.height, std::min(image.channels, 3));
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int k = 0; k < raster.channels; ++k) raster.at(x, y)[k] = image.at(x, y)[k];
    return raster;
}

}  // namespace ewa::reference
