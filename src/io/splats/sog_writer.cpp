// SPDX-License-Identifier: Apache-2.0
// Writes SOG, whose layout sog.h describes, in version 2.
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/splat_edit.h"
#include "io/splats/archive.h"
#include "io/splats/clusters.h"
#include "io/splats/formats.h"
#include "io/splats/render_mark.h"
#include "io/splats/sog.h"
#include "io/splats/splat_values.h"
#include "io/splats/webp.h"

namespace ewa::io {

namespace {

using Pixel = std::array<uint8_t, 4>;
using nlohmann::ordered_json;

double log_of_place(double v) {
    return std::copysign(std::log1p(std::abs(v)), v);
}

Pixel packed_rotation(const float* stored) {
    const std::array<double, 4> q = unit_quaternion(stored);
    const size_t largest = largest_component(q);
    const double sign = q[largest] < 0 ? -1 : 1;  // -q is the same rotation
    Pixel pixel{0, 0, 0, uint8_t(kFirstRotation + int(largest))};
    size_t next = 0;
    for (size_t i = 0; i < 4; ++i)
        if (i != largest) pixel[next++] = to_byte(255 * (sign * q[i] / std::numbers::sqrt2 + 0.5));
    return pixel;
}

std::vector<uint32_t> order_of_scene(const Gaussians& gaussians) {
    std::vector<uint32_t> order(gaussians.size());
    std::iota(order.begin(), order.end(), 0u);
    return order;
}

/// The images of a SOG, and the meta.json that names them.
class SogPacker {
  public:
    SogPacker(const Gaussians& gaussians, const SaveOptions& options, bool morton)
        : g_(gaussians),
          options_(options),
          order_(morton ? morton_order(gaussians) : order_of_scene(gaussians)) {
        const auto side = uint64_t(std::ceil(std::sqrt(double(g_.size())) / 4)) * 4;
        width_ = std::max<uint64_t>(4, side);
        height_ = std::max<uint64_t>(4, (g_.size() + 4 * width_ - 1) / (4 * width_) * 4);
    }

    bool fits() const { return height_ <= kMostWebpSide && width_ <= kMostWebpSide; }
    uint64_t palette() const { return palette_; }  // its rows

    /// The images, in the order of kSogImages.
    std::vector<std::string> images() {
        meta_["version"] = 2;
        meta_["asset"]["generator"] = "ewa " EWA_VERSION;
        meta_["count"] = g_.size();
        meta_["antialias"] = options_.antialiased;
        if (options_.antialiased) meta_["model"] = kAntialiasedModel;
        add_means();
        add_scales();
        add_rotations();
        add_colors();
        if (g_.sh_degree > 0 && g_.size() > 0) add_sh();
        return std::move(images_);
    }

    /// The text of the meta.json for images of these names.
    std::string meta(const Paths& names) const {
        ordered_json meta = meta_;
        for (ordered_json& part : meta)
            if (part.is_object() && part.contains("files"))
                for (ordered_json& file : part["files"]) file = names[file.get<size_t>()].filename().string();
        return meta.dump() + "\n";
    }

  private:
    void add_image(const char* part, SogImage image, const std::vector<uint8_t>& rgba, uint64_t width,
                   uint64_t height) {
        images_.push_back(encode_webp(rgba, width, height));
        meta_[part]["files"].push_back(size_t(image));
        const size_t all = g_.sh_degree > 0 ? kSogImages.size() : kSogImages.size() - 2;
        if (options_.progress) options_.progress(g_.size() * images_.size() / all, g_.size());
    }

    /// Adds an image with a pixel per splat, which pixel_of(i) gives.
    template <class PixelOf>
    void add_splats(const char* part, SogImage image, const PixelOf& pixel_of) {
        std::vector<uint8_t> rgba(size_t(4 * width_ * height_));
        for (size_t at = 0; at < order_.size(); ++at) {
            const Pixel pixel = pixel_of(size_t(order_[at]));
            std::copy(pixel.begin(), pixel.end(), &rgba[4 * at]);
        }
        for (size_t at = order_.size(); at < rgba.size() / 4; ++at) rgba[4 * at + 3] = 255;
        add_image(part, image, rgba, width_, height_);
    }

    void add_means() {
        std::array<double, 3> low{}, high{};
        for (size_t i = 0; i < g_.means.size(); ++i) {
            const double v = log_of_place(g_.means[i]);
            low[i % 3] = i < 3 ? v : std::min(low[i % 3], v);
            high[i % 3] = i < 3 ? v : std::max(high[i % 3], v);
        }
        meta_["means"] = {{"mins", low}, {"maxs", high}};
        const auto bytes_of = [&](int shift) {
            return [&, shift](size_t i) {
                Pixel pixel{0, 0, 0, 255};
                for (size_t k = 0; k < 3; ++k) {
                    const double range = high[k] - low[k];
                    const double share = range > 0 ? (log_of_place(g_.means[3 * i + k]) - low[k]) / range : 0;
                    pixel[k] = uint8_t(to_level(65535 * share, 65535) >> shift);
                }
                return pixel;
            };
        };
        add_splats("means", SogImage::means_low, bytes_of(0));
        add_splats("means", SogImage::means_high, bytes_of(8));
    }

    SogTable add_codebook(const char* part, std::vector<float> values) {
        if (values.empty()) values = {0};
        const SogTable table = make_codebook(std::move(values));
        meta_[part]["codebook"] = table;
        return table;
    }

    void add_scales() {
        const SogTable table = add_codebook("scales", g_.log_scales);
        add_splats("scales", SogImage::scale_codes, [&](size_t i) {
            Pixel pixel{0, 0, 0, 255};
            for (size_t k = 0; k < 3; ++k) pixel[k] = nearest(table, g_.log_scales[3 * i + k]);
            return pixel;
        });
    }

    void add_rotations() {
        add_splats("quats", SogImage::rotation_bytes,
                   [&](size_t i) { return packed_rotation(&g_.quaternions[4 * i]); });
    }

    void add_colors() {
        std::vector<float> values;
        values.reserve(3 * g_.size());
        for (size_t i = 0; i < g_.size(); ++i)
            values.insert(values.end(), &g_.sh[g_.sh_stride() * i], &g_.sh[g_.sh_stride() * i] + 3);
        const SogTable table = add_codebook("sh0", std::move(values));
        add_splats("sh0", SogImage::color_codes, [&](size_t i) {
            Pixel pixel{0, 0, 0, to_byte(255 * sigmoid(g_.opacity_logits[i]))};
            for (size_t k = 0; k < 3; ++k) pixel[k] = nearest(table, g_.sh[g_.sh_stride() * i + k]);
            return pixel;
        });
    }

    void add_sh() {
        const size_t coefficients = size_t(sh_coefficients(g_.sh_degree)) - 1;
        const Palette palette = make_palette({g_.sh.data() + 3, g_.size(), g_.sh_stride(), 3 * coefficients},
                                             size_t(kMostPalette));
        palette_ = palette.rows.size() / (3 * coefficients);
        meta_["shN"] = {{"count", palette_}, {"bands", g_.sh_degree}};
        const SogTable table = add_codebook("shN", palette.rows);

        const uint64_t width = kPaletteRow * coefficients,
                       height = (palette_ + kPaletteRow - 1) / kPaletteRow;
        std::vector<uint8_t> rgba(size_t(4 * width * height), 255);
        for (size_t at = 0; at < palette.rows.size(); ++at)
            rgba[at / 3 * 4 + at % 3] = nearest(table, palette.rows[at]);
        add_image("shN", SogImage::palette_codes, rgba, width, height);
        add_splats("shN", SogImage::labels, [&](size_t i) {
            const uint32_t label = palette.labels[i];
            return Pixel{uint8_t(label), uint8_t(label >> 8), 0, 255};
        });
    }

    const Gaussians& g_;
    const SaveOptions& options_;
    const std::vector<uint32_t> order_;
    uint64_t width_ = 0, height_ = 0, palette_ = 0;
    ordered_json meta_;
    std::vector<std::string> images_;
};

std::vector<std::string> remarks_of(const Gaussians& gaussians, uint64_t palette) {
    std::vector<std::string> remarks = {"the splats are in Morton order",
                                        "positions have 16 bits of their logarithm; scales and colours are "
                                        "one of 256 values each, opacities and "
                                        "rotations have 8 bits per component"};
    if (gaussians.sh_degree == 0 || gaussians.size() == 0) return remarks;
    remarks.push_back("SH coefficients of degree 1 and more are one of 256 values each");
    if (palette < gaussians.size())
        remarks.push_back(std::to_string(palette) + " sets of them stand for those of all splats");
    return remarks;
}

SogPacker packer_for(const std::filesystem::path& path, const Gaussians& gaussians,
                     const SaveOptions& options, bool morton = true) {
    SogPacker packer(gaussians, options, morton);
    if (!packer.fits())
        throw InputError(path.string() +
                         ": SOG holds about 268 million splats, as many as a WebP image has pixels");
    return packer;
}

}  // namespace

std::vector<std::string> write_sog(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options) {
    core::AtomicFile file(path);
    std::vector<std::string> remarks;
    file.write(pack_sog(path, gaussians, options, remarks));
    file.commit();
    return remarks;
}

std::string pack_sog(const std::filesystem::path& path, const Gaussians& gaussians,
                     const SaveOptions& options, std::vector<std::string>& remarks) {
    SogPacker packer = packer_for(path, gaussians, options);
    ArchiveWriter archive;
    const std::vector<std::string> images = packer.images();
    for (size_t i = 0; i < images.size(); ++i) archive.add(kSogImages[i], images[i]);
    archive.add(kSogMeta, packer.meta(Paths(kSogImages.begin(), kSogImages.end())));
    remarks = remarks_of(gaussians, packer.palette());
    return archive.finish();
}

ValueFiles sog_value_files(const std::filesystem::path& meta) {
    Paths usual;
    for (const char* image : kSogImages) usual.push_back(meta.parent_path() / image);
    return value_files(meta, usual, sog_images);
}

namespace {

std::vector<std::string> write_meta(const std::filesystem::path& path, const Gaussians& gaussians,
                                    const SaveOptions& options, bool morton) {
    SogPacker packer = packer_for(path, gaussians, options, morton);
    NewValues values(path, sog_value_files);
    for (const std::string& bytes : packer.images()) values.add().write(bytes);
    values.replace(packer.meta(values.claim()));
    return remarks_of(gaussians, packer.palette());
}

}  // namespace

std::vector<std::string> write_sog_meta(const std::filesystem::path& path, const Gaussians& gaussians,
                                        const SaveOptions& options) {
    return write_meta(path, gaussians, options, true);
}

std::vector<std::string> write_sog_rows(const std::filesystem::path& path, const Gaussians& gaussians,
                                        const SaveOptions& options) {
    return write_meta(path, gaussians, options, false);
}

}  // namespace ewa::io
