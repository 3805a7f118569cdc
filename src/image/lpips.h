// SPDX-License-Identifier: Apache-2.0
// LPIPS (Zhang et al. 2018, version 0.1), with the weights of a file.
#pragma once
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "ewa/image.h"
#include "image/tensors.h"

namespace ewa::image {

/// A layer of a network: a max-pool, a convolution with zero padding, and max(0, x).
struct LpipsLayer {
    const char* name;  // torchvision's number in `features`
    int channels;
    int kernel, stride, padding;
    int pool;       // side of the max-pool before it, of stride 2; 0: none
    bool compared;  // whether LPIPS compares its result
};

class Lpips {
  public:
    enum class Network { vgg, alex };

    /// weights: with `vgg.features.N.weight` and `.bias` for each layer N, and `vgg.lin.K.weight` for each compared layer, in
    /// torchvision's and lpips' shapes; or `alex.` in place of `vgg.`. file: its name in errors. Throws InputError.
    Lpips(Network network, const std::map<std::string, Tensor>& weights, const std::string& file,
          bool unit_range);

    /// NaN if the images are too small for the network, or all weights are zero. Arguments as in metric.h. A pixel of a
    /// layer has the mean weight of the pixels in its place.
    double distance(const Image& a, const Image& b, const Image& weights) const;

  private:
    struct Filters {
        LpipsLayer layer;
        int inputs = 0;
        std::vector<float> packed, bias;
        std::vector<float> scores;  // weight of each channel's difference; empty unless compared
    };
    bool unit_range_;
    std::vector<Filters> layers_;
};

}  // namespace ewa::image
