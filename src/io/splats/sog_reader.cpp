// SPDX-License-Identifier: Apache-2.0
// Reads SOG, whose layout sog.h describes.
#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/json.h"
#include "core/json_field.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "io/splats/formats.h"
#include "io/splats/render_mark.h"
#include "io/splats/sog.h"
#include "io/splats/splat_values.h"
#include "io/splats/webp.h"
#include "io/splats/zip_files.h"

namespace ewa::io {

namespace {

using nlohmann::json;

/// Real ones have about 20 kB.
constexpr core::JsonLimits kMetaLimits = {.bytes = 1 << 20, .objects = 1024, .values = 1 << 16};

/// All names of images in a meta.json.
std::vector<std::string> image_names_in(const json& meta) {
    std::vector<std::string> names;
    for (const json& part : meta)
        if (part.is_object() && part.contains("files"))
            for (const json& file : part["files"])
                if (file.is_string()) names.push_back(file.get<std::string>());
    return names;
}

/// The files of a SOG by the names that its meta.json has for them.
struct SogFiles {
    std::function<std::string(const std::string& name)> read;
    std::function<uint64_t()> bytes;  // of all together
};

/// Throws InputError unless the image is in the folder of the meta.json.
std::filesystem::path image_beside(const std::filesystem::path& meta, const std::string& name) {
    const auto inside = core::name_inside(name);
    const std::filesystem::path folder = meta.parent_path();
    if (!inside || !core::links_stay_inside(folder, *inside))
        throw InputError(
            core::one_line(meta.string() + ": names the image \"" + name + "\", which is not in its folder"));
    if (!core::is_file(folder / *inside))
        throw InputError(core::one_line(meta.string() + ": the image \"" + name + "\" is missing beside it"));
    return folder / *inside;
}

constexpr const char* kSogAdvice = "; it is damaged, or not of a SOG";
constexpr uint64_t kMostSogSplats = kMostWebpSide * kMostWebpSide;

/// 256 steps from low to high, as in version 1.
SogTable steps_between(double low, double high) {
    SogTable table;
    for (size_t i = 0; i < table.size(); ++i) table[i] = float(low + (high - low) * (double(i) / 255));
    return table;
}

/// The values of a meta.json.
class Meta : public core::JsonField {
  public:
    explicit Meta(const core::JsonField& top) : core::JsonField(top) {
        if (!value().is_object()) fail("the JSON is not an object");
        version_ = has("version") ? whole("version", 1 << 30) : 1;
        if (version_ != 1 && version_ != 2)
            fail("SOG version " + std::to_string(version_) +
                 " in \"version\" is unknown; 1 and 2 are supported");
        if (version_ == 2) {
            count_ = whole("count", kMostSogSplats);
        } else {
            const auto shape = part("means").items("shape");
            if (shape.empty()) fail("\"shape\" of \"means\" is empty");
            count_ = shape[0].whole(nullptr, kMostSogSplats);
        }
    }

    uint64_t version() const { return version_; }
    uint64_t count() const { return count_; }
    /// splat-transform's mark; empty where there is none.
    std::string model() const { return core::text_in(value(), "model"); }
    bool antialiased() const {
        const std::string mark = model();
        if (mark == kAntialiasedModel || mark == kSurfels || mark == "default")
            return mark == kAntialiasedModel;
        const auto found = value().find("antialias");
        return found != value().end() && *found == true;
    }

    /// The name of an image of a part.
    std::string image(const char* part_name, size_t index) const {
        const auto files = part(part_name).items("files");
        if (files.size() <= index)
            fail("\"files\" of \"" + std::string(part_name) + "\" does not name image " +
                 std::to_string(index));
        return files[index].text(nullptr);
    }

    /// Version 1's tables of the channels of a part.
    std::vector<SogTable> steps(const char* part_name, size_t channels) const {
        const core::JsonField field = part(part_name);
        const auto low = field.numbers("mins", channels), high = field.numbers("maxs", channels);
        std::vector<SogTable> tables;
        for (size_t k = 0; k < channels; ++k) tables.push_back(steps_between(low[k], high[k]));
        return tables;
    }

    /// Version 2's table of a part.
    SogTable codebook(const char* part_name) const {
        SogTable table;
        const std::vector<double> values = part(part_name).numbers("codebook", 1, table.size());
        // No splat of a whole file refers to values after the last.
        for (size_t i = 0; i < table.size(); ++i) table[i] = float(values[std::min(i, values.size() - 1)]);
        return table;
    }

  private:
    uint64_t version_ = 0, count_ = 0;
};

class SogReader {
  public:
    SogReader(Meta meta, const SogFiles& files) : meta_(std::move(meta)), files_(files) {}

    SplatScene read() {
        scene_.variant = "version " + std::to_string(meta_.version());
        scene_.antialiased = meta_.antialiased();
        if (meta_.model() == kSurfels) remark_surfels(scene_);
        Image centroids;
        if (meta_.has("shN")) centroids = palette_image();
        Gaussians& g = scene_.gaussians;
        scene_.file_sh_degree = g.sh_degree;
        // An image of no splats may have no pixels, which WebP lacks.
        if (meta_.count() == 0) return std::move(scene_);
        require_memory(meta_.where(), files_.bytes(), meta_.count(), g.sh_degree, kPackedExpansion);
        g.resize(size_t(meta_.count()));
        read_means();
        read_rotations();
        read_scales();
        read_colors();
        if (g.sh_degree > 0) read_sh(centroids);
        return std::move(scene_);
    }

  private:
    struct Image {
        std::string bytes, name;  // encoded; for errors
        WebpHead head;
    };

    Image open(const char* part, size_t index) {
        const std::string file = meta_.image(part, index);
        Image image{files_.read(file), meta_.where() + ": \"" + core::one_line(file) + "\"", {}};
        image.head = webp_head(image.bytes, image.name);
        if (!image.head.lossless)
            scene_.remarks.push_back("the image " + file + " is not lossless, so its values are not exact");
        return image;
    }

    static std::string size_text(const WebpHead& head) {
        return std::to_string(head.width) + "×" + std::to_string(head.height);
    }

    /// The pixels of an image with one per splat. All such images have one size.
    std::vector<uint8_t> pixels(const char* part, size_t index) {
        const Image image = open(part, index);
        const uint64_t count = meta_.count();
        if (size_.pixels() == 0) {
            constexpr uint64_t kSpare = 65536;
            size_ = image.head;
            if (size_.pixels() < count || size_.pixels() > 2 * count + kSpare)
                throw InputError(image.name + " has " + size_text(size_) + " pixels, which does not fit " +
                                 std::to_string(count) + " splats");
        } else if (image.head.width != size_.width || image.head.height != size_.height) {
            throw InputError(image.name + " has " + size_text(image.head) +
                             " pixels; the other images have " + size_text(size_));
        }
        return decode_webp(image.bytes, image.name);
    }

    /// Opens the palette's image and sets the SH degree by its size.
    Image palette_image() {
        Image image = open("shN", 0);
        int degree = 0;
        for (int d = 1; d <= kMaxShDegree; ++d)
            if (image.head.width == kPaletteRow * uint64_t(sh_coefficients(d) - 1)) degree = d;
        const bool fits = degree > 0 && image.head.height <= kMostPalette / kPaletteRow;
        if (!fits || (meta_.version() == 2 && meta_.part("shN").whole("bands", 3) != uint64_t(degree)))
            throw InputError(image.name + " has " + size_text(image.head) +
                             " pixels, which does not fit the palette of an SH degree");
        palette_ = image.head.height * kPaletteRow;
        if (meta_.version() == 2)
            palette_ = std::min(palette_, meta_.part("shN").whole("count", kMostPalette));
        scene_.gaussians.sh_degree = degree;
        return image;
    }

    void read_means() {
        Gaussians& g = scene_.gaussians;
        // The low bytes wait in the means, so that one image is in memory at a time.
        const auto each = [&](size_t image, const auto& set) {
            const std::vector<uint8_t> rgba = pixels("means", image);
            for (size_t i = 0; i < g.size(); ++i)
                for (size_t k = 0; k < 3; ++k) set(g.means[3 * i + k], rgba[4 * i + k], k);
        };
        each(0, [](float& mean, uint8_t low, size_t) { mean = low; });
        const auto from = meta_.part("means").numbers("mins", 3), to = meta_.part("means").numbers("maxs", 3);
        each(1, [&](float& mean, uint8_t high, size_t k) {
            const double v = from[k] + (to[k] - from[k]) * ((double(mean) + 256.0 * high) / 65535);
            mean = float(std::copysign(std::expm1(std::abs(v)), v));
        });
    }

    void read_rotations() {
        const std::vector<uint8_t> rgba = pixels("quats", 0);
        Gaussians& g = scene_.gaussians;
        size_t unknown = 0;
        for (size_t i = 0; i < g.size(); ++i) {
            float* q = &g.quaternions[4 * i];
            const uint8_t* pixel = &rgba[4 * i];
            if (pixel[3] < kFirstRotation) {
                q[0] = 1;
                ++unknown;
                continue;
            }
            const auto largest = size_t(pixel[3] - kFirstRotation);
            double sum = 0;
            for (size_t k = 0; k < 4; ++k) {
                if (k == largest) continue;
                const double c = (*pixel++ / 255.0 - 0.5) * std::numbers::sqrt2;
                q[k] = float(c);
                sum += c * c;
            }
            q[largest] = float(std::sqrt(std::max(0.0, 1 - sum)));
        }
        if (unknown > 0)
            scene_.remarks.push_back(std::to_string(unknown) +
                                     " rotations are of an unknown kind and are left out");
    }

    void read_scales() {
        const auto tables = meta_.version() == 1 ? meta_.steps("scales", 3)
                                                 : std::vector<SogTable>(3, meta_.codebook("scales"));
        const std::vector<uint8_t> rgba = pixels("scales", 0);
        Gaussians& g = scene_.gaussians;
        for (size_t i = 0; i < g.size(); ++i)
            for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = tables[k][rgba[4 * i + k]];
    }

    void read_colors() {
        auto tables =
            meta_.version() == 1 ? meta_.steps("sh0", 4) : std::vector<SogTable>(4, meta_.codebook("sh0"));
        if (meta_.version() == 2)
            for (uint32_t level = 0; level < 256; ++level)
                tables[3][level] = float(logit_of_level(level, 255));
        const std::vector<uint8_t> rgba = pixels("sh0", 0);
        Gaussians& g = scene_.gaussians;
        for (size_t i = 0; i < g.size(); ++i) {
            for (size_t k = 0; k < 3; ++k) g.sh[g.sh_stride() * i + k] = tables[k][rgba[4 * i + k]];
            g.opacity_logits[i] = tables[3][rgba[4 * i + 3]];
        }
    }

    void read_sh(const Image& centroids) {
        const core::JsonField part = meta_.part("shN");
        const SogTable table = meta_.version() == 2 ? meta_.codebook("shN")
                                                    : steps_between(part.number("mins"), part.number("maxs"));
        const std::vector<uint8_t> palette = decode_webp(centroids.bytes, centroids.name);
        const std::vector<uint8_t> labels = pixels("shN", 1);
        Gaussians& g = scene_.gaussians;
        const size_t coefficients = size_t(sh_coefficients(g.sh_degree)) - 1;
        for (size_t i = 0; i < g.size(); ++i) {
            const size_t label = labels[4 * i] + size_t(256) * labels[4 * i + 1];
            if (label >= palette_)
                meta_.fail("splat " + std::to_string(i) + " refers to row " + std::to_string(label) +
                           " of the palette \"shN\", which has " + std::to_string(palette_));
            const uint8_t* row = &palette[4 * coefficients * label];
            float* sh = &g.sh[g.sh_stride() * i + 3];
            for (size_t k = 0; k < coefficients; ++k)
                for (size_t channel = 0; channel < 3; ++channel)
                    sh[3 * k + channel] = table[row[4 * k + channel]];
        }
    }

    const Meta meta_;
    const SogFiles& files_;
    SplatScene scene_;
    WebpHead size_;         // of the images with a pixel per splat
    uint64_t palette_ = 0;  // its rows
};

}  // namespace

SplatScene read_sog(const std::filesystem::path& path) {
    ZipFiles archive(path);
    const std::string name = core::one_line(path.string());
    const SogFiles files{
        [&](const std::string& file) {
            const auto found =
                std::ranges::find(archive.entries(), std::filesystem::path(file), &ZipFiles::Entry::name);
            if (found == archive.entries().end())
                throw InputError(name + ": \"" + core::one_line(file) + "\" is not in the archive");
            return archive.text(*found);
        },
        [&] { return uint64_t(std::filesystem::file_size(path)); }};
    const auto top = core::JsonField::of_text(files.read(kSogMeta), name + ": \"" + kSogMeta + "\"",
                                              kMetaLimits, kSogAdvice);
    SplatScene scene = SogReader(Meta(top), files).read();
    scene.format = SplatFormat::sog;
    return scene;
}

SplatScene read_sog_meta(const std::filesystem::path& path) {
    const auto top = core::JsonField::of_file(path, kMetaLimits, kSogAdvice);
    const SogFiles files{
        [&](const std::string& file) { return core::read_text_file(image_beside(path, file)); },
        [&] {
            uint64_t sum = std::filesystem::file_size(path);
            for (const std::string& file : image_names_in(top.value()))
                sum += std::filesystem::file_size(image_beside(path, file));
            return sum;
        }};
    SplatScene scene = SogReader(Meta(top), files).read();
    scene.format = SplatFormat::sog_meta;
    scene.variant += ", unpacked";
    return scene;
}

bool is_sog_meta(const std::filesystem::path& path) try {
    if (core::FileReader(path).size() > kMetaLimits.bytes) return false;
    const json values = core::read_json_file<json>(path, kMetaLimits);
    return values.contains("means") && values.contains("quats");
} catch (const InputError&) {
    return false;
}

std::vector<std::filesystem::path> sog_images(const std::filesystem::path& meta) try {
    std::vector<std::filesystem::path> images;
    if (!core::is_file(meta)) return images;
    const json values = core::read_json_file<json>(meta, kMetaLimits);
    for (const std::string& name : image_names_in(values)) images.push_back(image_beside(meta, name));
    return images;
} catch (const InputError&) {
    return {};
}

}  // namespace ewa::io
