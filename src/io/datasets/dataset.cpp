// SPDX-License-Identifier: Apache-2.0
// Reads the model of a dataset, and checks its images and masks.
#include "ewa/dataset.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/folders.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "image/image_files.h"
#include "io/datasets/camera_files.h"
#include "io/datasets/companions.h"
#include "io/datasets/image_records.h"
#include "scene/camera.h"
#include "scene/intrinsics.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa {

namespace {

namespace fs = std::filesystem;
using core::is_file;
using core::is_folder;

std::string size_text(int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
}

/// Whether a folder of the dataset has this file. Throws if a link leads out of the dataset.
bool has_file(const fs::path& folder, const fs::path& name) {
    const fs::path path = folder / name;
    if (!is_file(path)) return false;
    if (!core::links_stay_with_images(folder.parent_path(), folder.filename() / name))
        throw InputError(core::one_line(path.string()) + ": is a link out of the dataset's folder; " +
                         core::kLinkAdvice);
    return true;
}

/// The image file of a frame: the model's, or its copy in images_K for a downscale factor K.
struct ImageFile {
    fs::path path;
    bool exists = false;
    int downscale = 1;  // factor that still has to be applied
};

ImageFile find_image(const io::ImageRecord& image, const fs::path& folder, int downscale) {
    if (downscale > 1) {
        const fs::path inside = core::inside(image.path, folder);
        const fs::path copies =
            folder.parent_path() / (folder.filename().string() + "_" + std::to_string(downscale));
        if (!inside.empty() && *inside.begin() != ".." && has_file(copies, inside))
            return {copies / inside, true, 1};
    }
    return {image.path, is_file(image.path), downscale};
}

/// Photos may be damaged long after their cameras were found. One of them costs its view, and not the rest.
void leave_out_damaged(ImageFile& file, const std::string& name, Dataset& dataset) {
    if (!file.exists || image::ends_as_an_image(file.path)) return;
    const std::string fault = image::image_fault(file.path);
    if (fault.empty()) return;
    file.exists = false;
    dataset.unreadable.push_back(core::one_line(name + " (" + fault + ")"));
}

/// Resolves MaskUse::automatic once for the whole dataset.
void settle_masks(Dataset& dataset, MaskUse wanted) {
    const bool files = std::any_of(dataset.frames.begin(), dataset.frames.end(),
                                   [](const Frame& frame) { return !frame.mask_path.empty(); });
    if (wanted == MaskUse::automatic) wanted = files ? MaskUse::ignore : MaskUse::cut;
    for (Frame& frame : dataset.frames) {
        frame.masks = wanted;
        if (wanted == MaskUse::none) frame.mask_path.clear();
    }
}

/// Gives the frames their masks and depth maps, and notes what was found. records: of the frames.
void add_companions(const io::ImageRecords& model, const std::vector<const io::ImageRecord*>& records,
                    const DatasetOptions& options, Dataset& dataset) {
    using Kind = io::Companions::Kind;
    for (const Kind kind : {Kind::masks, Kind::depth_maps}) {
        const auto file_of = [&](Frame& frame) -> fs::path& {
            return kind == Kind::masks ? frame.mask_path : frame.depth_path;
        };
        io::Companions files(kind, model, dataset.root, options.downscale);
        for (size_t i = 0; i < records.size(); ++i) file_of(dataset.frames[i]) = files.find(*records[i]);
        const fs::path of_all = files.of_all();
        std::vector<std::string> bare;
        for (Frame& frame : dataset.frames) {
            if (!of_all.empty()) file_of(frame) = of_all;
            if (file_of(frame).empty()) bare.push_back(frame.name);
        }
        UsedOf used = files.used(bare);
        if (kind == Kind::masks && options.masks == MaskUse::none && used.found > 0) {
            used.used = 0;
            used.why = "--masks none";
        }
        if (used.found > 0) dataset.used.push_back(std::move(used));
    }
}

/// Scales frame.source to the size of the file and sets the orientation. Throws if the aspect ratios differ.
void fit_to_file(Frame& frame) {
    const ImageSize size = read_image_size(frame.image_path);
    Camera& camera = frame.source;
    const bool stored = same_aspect(camera.width, camera.height, size.width, size.height);
    const bool turned =
        !stored && size.orientation >= 5 && same_aspect(camera.width, camera.height, size.height, size.width);
    const int width = turned ? size.height : size.width, height = turned ? size.width : size.height;
    frame.orientation = turned ? size.orientation : 1;
    frame.eight_bit = size.eight_bit;
    if (!stored && !turned)
        throw InputError(core::one_line(frame.image_path.string() + ": frame \"" + frame.name + "\" is " +
                                        size_text(size.width, size.height) + " pixels, but its camera has " +
                                        size_text(camera.width, camera.height)));
    const double x = double(width) / camera.width, y = double(height) / camera.height;
    camera.width = width;
    camera.height = height;
    camera.fx *= x;
    camera.cx *= x;
    camera.fy *= y;
    camera.cy *= y;
}

/// The cameras that images are rendered through, one per lens: finding one takes some milliseconds, and most datasets have few
/// lenses.
class CameraCache {
  public:
    explicit CameraCache(LensUse use) : use_(use) {}
    /// A pinhole, or `source` with its lens.
    Camera of(const Camera& source, const Distortion& distortion) {
        if (distortion.none()) return source;
        if (source.readout) return rolling(source, distortion);
        const auto known = std::find_if(known_.begin(), known_.end(), [&](const Known& k) {
            const Camera& c = k.source;
            return k.distortion == distortion && c.width == source.width && c.height == source.height &&
                   c.fx == source.fx && c.fy == source.fy && c.cx == source.cx && c.cy == source.cy;
        });
        if (known == known_.end()) {
            known_.push_back({source, distortion, chosen(source, distortion)});
            return known_.back().camera;
        }
        Camera camera = known->camera;
        camera.rotation = source.rotation;
        camera.translation = source.translation;
        return camera;
    }

  private:
    /// The rows of an undistorted image would be read at no one time.
    Camera rolling(const Camera& source, const Distortion& distortion) const {
        if (use_ == LensUse::undistort || !scene::is_native(distortion))
            throw InputError(
                "images of a rolling shutter cannot be undistorted; --lens native takes pinholes, OpenCV's "
                "perspective model and fisheyes");
        Camera native = source;
        native.distortion = distortion;
        return native;
    }

    Camera chosen(const Camera& source, const Distortion& distortion) const {
        Camera native = source;
        native.distortion = distortion;
        if (use_ == LensUse::native) {
            if (!scene::is_native(distortion))
                throw InputError("splats cannot be rendered through this lens model; take --lens undistort");
            return native;
        }
        if (use_ == LensUse::automatic && !scene::has_pinhole(distortion.lens)) return native;
        return scene::undistorted_camera(source, distortion);
    }

    struct Known {
        Camera source;
        Distortion distortion;
        Camera camera;
    };
    LensUse use_;
    std::vector<Known> known_;
};

/// where: begins the errors of the camera.
Frame make_frame(const io::ImageRecord& image, const ImageFile& file, const DatasetOptions& options,
                 CameraCache& cameras, const std::string& where) {
    Frame frame;
    frame.name = image.name;
    frame.image_path = file.path;
    frame.image_exists = file.exists;
    frame.source = image.camera;
    frame.downscale = file.downscale;
    try {
        if (file.exists) fit_to_file(frame);
    } catch (const InputError&) {
        // If only cameras are needed, the model's size replaces that of an unusable image.
        if (options.need_images) throw;
        frame.downscale = options.downscale;
    }
    if (options.max_width > 0) {
        const int width = frame.source.width;
        frame.source = narrowed(frame.source, int64_t(options.max_width) * frame.downscale);
        frame.reduced = frame.source.width < width;
    }
    frame.split = image.split;
    try {
        if (const std::string fault = scene::intrinsics_fault(frame.source, image.distortion); !fault.empty())
            throw InputError(fault);
        frame.pinhole = cameras.of(frame.source, image.distortion);
        if (frame.pinhole.distortion.none()) frame.distortion = image.distortion;
        frame.camera = downscale(frame.pinhole, frame.downscale);
        scene::check_readout(frame.camera);
    } catch (const InputError& error) {
        throw InputError(core::one_line(where + ": frame \"" + image.name + "\": " + error.what()));
    }
    return frame;
}

/// images: sorted by name.
void note_repeated(const std::vector<io::ImageRecord>& images, std::vector<std::string>& notes) {
    const auto same = [](const io::ImageRecord& a, const io::ImageRecord& b) { return a.name == b.name; };
    if (const auto first = std::ranges::adjacent_find(images, same); first != images.end())
        notes.push_back("the image " + core::one_line(first->name) +
                        " has several cameras, each of which counts as an image");
}

/// Throws if a camera has no finite position, or is so far away that its distance is not finite.
void check_positions(const Dataset& dataset) {
    glm::dvec3 mean(0.0);
    for (const Frame& frame : dataset.frames) mean += frame.camera.position() / double(dataset.frames.size());
    // A single camera far away would move the mean, and so make every other distance infinite.
    for (const bool from_mean : {false, true})
        for (const Frame& frame : dataset.frames) {
            const glm::dvec3 zero = from_mean ? mean : glm::dvec3(0.0);
            const double far = glm::length(frame.camera.position() - zero) +
                               glm::length(scene::at_share(frame.camera, 1).position() - zero);
            if (!std::isfinite(far))
                throw InputError(
                    core::one_line(dataset.root.string() + ": frame \"" + frame.name +
                                   "\": the position of its camera, or the distance to it, is not "
                                   "a finite number"));
        }
}

/// Few lenses look at the corner of their images.
void note_corner(const io::ImageRecords& records, std::vector<std::string>& notes) {
    const auto image = std::ranges::find_if(records.images, [](const io::ImageRecord& each) {
        const Camera& c = each.camera;
        return c.width > 1 && c.height > 1 && std::abs(c.cx) <= 1 && std::abs(c.cy) <= 1 &&
               each.distortion.lens != Lens::orthographic;
    });
    if (image != records.images.end())
        notes.push_back("the principal point of " + core::one_line(image->name) +
                        " is the corner of the image; cx and cy, in pixels, are usually half of its size");
}

/// Photos of another folder may be those of something else.
void note_photos_outside(Dataset& dataset) {
    const auto frame = std::ranges::find_if(dataset.frames, &Frame::image_exists);
    if (frame == dataset.frames.end()) return;
    std::error_code error;
    const fs::path place =
        fs::absolute(frame->image_path, error)
            .lexically_normal()
            .lexically_relative(fs::absolute(dataset.root / "x", error).lexically_normal().parent_path());
    if (!place.empty() && *place.begin() == "..")
        dataset.notes.push_back("photos are outside the dataset, in " +
                                core::one_line(frame->image_path.parent_path().lexically_normal().string()));
}

[[noreturn]] void refuse_without_images(const std::string& name, const io::ImageRecords& model) {
    const fs::path& folder = model.folder;
    std::string text = name + ": none of the " + std::to_string(model.images.size()) +
                       " images exists, the first being " +
                       core::one_line(model.images.front().path.string());
    if (!is_folder(folder)) text += "; the folder of the images is missing";
    for (const int factor : {2, 4, 8})
        if (const std::string smaller = folder.filename().string() + "_" + std::to_string(factor);
            !is_folder(folder) && is_folder(folder.parent_path() / smaller))
            throw InputError(text + ", and " + core::one_line(smaller) + " is there: --downscale " +
                             std::to_string(factor) + " takes it");
    throw InputError(text);
}

}  // namespace

Dataset load_dataset(const std::filesystem::path& given, const DatasetOptions& options) {
    const fs::path path = given.has_filename() ? given : given.parent_path();
    if (options.downscale < 1) throw InputError("the downscale factor must be 1 or more");
    io::ImageRecords model = io::read_model(path, options);
    const std::string name = core::one_line(path.string());
    if (model.images.empty()) throw InputError(name + ": the dataset has no images");
    io::note_partial_spheres(model);
    Dataset dataset;
    dataset.root = is_folder(path) ? path : path.parent_path();
    dataset.files = std::move(model.files);
    dataset.points = std::move(model.points);
    dataset.color_depends_on_view = model.color_depends_on_view;
    dataset.dropped_points = model.dropped.count;
    dataset.first_dropped_point = std::move(model.dropped.first);
    dataset.format = std::move(model.format);
    dataset.program = std::move(model.program);
    dataset.frame_rate = model.frame_rate;
    dataset.notes = std::move(model.notes);
    std::stable_sort(model.images.begin(), model.images.end(),
                     [](const io::ImageRecord& a, const io::ImageRecord& b) { return a.name < b.name; });
    note_repeated(model.images, dataset.notes);
    const bool path_of_cameras = model.frame_rate > 0;
    if (path_of_cameras && options.need_images)
        throw InputError(name + ": is a path of cameras without images; ewa render --cameras takes it");
    CameraCache cameras(path_of_cameras && options.lens == LensUse::automatic ? LensUse::native
                                                                              : options.lens);
    const bool captured = is_file(dataset.root / folders::kCaptureFile);
    std::vector<const io::ImageRecord*> records;
    for (const io::ImageRecord& image : model.images) {
        ImageFile file = find_image(image, model.folder, options.downscale);
        if (captured) leave_out_damaged(file, image.name, dataset);
        dataset.missing_images += !file.exists && !path_of_cameras;
        const bool usable = image.camera.width > 0 && (file.exists || !options.need_images);
        if (!usable) continue;
        dataset.frames.push_back(make_frame(image, file, options, cameras, name));
        records.push_back(&image);
        Frame& frame = dataset.frames.back();
        frame.depth_unit = image.depth_unit;
        if (!image.seen.empty()) frame.seen = std::make_shared<const std::vector<uint32_t>>(image.seen);
        frame.point_error = image.point_error;
    }
    if (dataset.format == "COLMAP" || dataset.format == "transforms") note_photos_outside(dataset);
    note_corner(model, dataset.notes);
    if (!path_of_cameras) {
        add_companions(model, records, options, dataset);
        dataset.used.insert(dataset.used.begin(), io::used_photos(model, dataset));
    }
    if (const uint64_t points = dataset.points.positions.size() + uint64_t(dataset.dropped_points);
        points > 0)
        dataset.used.push_back({.what = "point",
                                .used = dataset.points.positions.size(),
                                .found = points,
                                .why = dataset.dropped_points == 0
                                           ? std::string()
                                           : dataset.first_dropped_point + " is not finite"});
    if (model.models.found > 0) dataset.used.push_back(std::move(model.models));
    settle_masks(dataset, options.masks);
    check_positions(dataset);
    if (dataset.frames.empty()) refuse_without_images(name, model);
    return dataset;
}

}  // namespace ewa
