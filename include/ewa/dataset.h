// SPDX-License-Identifier: Apache-2.0
// Training images with their cameras, and the points that they were reconstructed from.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa {

/// The use of masks. A mask is white where the image counts. There are three sources of masks:
/// - A file in masks/ (beside images/) with the image's name. Its extension may be another or followed by .png, and the name may have
///   _mask. A mask that is alone in masks/, under another name, is for all images.
/// - A frame's mask_path in transforms.json.
/// - The image's own alpha.
enum class MaskUse {
    automatic,  // ignore if the dataset has mask files, else cut
    ignore,     // masked pixels do not count in the loss, PSNR and SSIM
    cut,        // masked pixels have the background's colour
    none        // masks and alpha are not used
};

/// How images through other lenses than a pinhole are used.
enum class LensUse {
    /// native for 360 degrees and parallel rays, which no pinhole shows; else undistort.
    automatic,
    native,    // splats are rendered through the lens; images stay as they are
    undistort  // images are resampled to those of a pinhole
};

/// A cached result of load_frame_image. It applies to a Frame with the same `downscale` and `left_out`.
struct KeptImage {
    Image image;
    int downscale = 1;
    std::shared_ptr<const Image> left_out;
};

/// An entry of a dataset: an image, its camera, mask and depth map.
struct Frame {
    std::string name;                  // in the dataset, e.g. "0001.jpg"
    std::filesystem::path image_path;  // may not exist: see image_exists
    bool image_exists = false;
    int orientation = 1;    // EXIF orientation to apply; 1 unless the camera belongs to the turned image
    bool eight_bit = true;  // the file has at most 256 levels
    Camera camera;          // of load_frame_image's result: a pinhole; with LensUse::native, with the lens
    Camera source;          // the camera of the file's pixels, before undistortion and downscaling
    bool reduced = false;   // DatasetOptions::max_width has made `source` smaller than the file
    std::filesystem::path mask_path;   // empty: none
    MaskUse masks = MaskUse::cut;      // the use of the file's alpha and mask; never automatic
    std::filesystem::path depth_path;  // a depth map of the file, .exr in world units or .png; empty: none
    double depth_unit = 0.001;         // world units per level of a .png depth map
    /// A further mask of `camera`'s image, of one channel and any size. Black pixels do not count and grey ones count
    /// less, whatever `masks` says. Null: none.
    std::shared_ptr<const Image> left_out;
    /// With left_out and MaskUse::cut: the colour of pixels that the mask cuts out. Empty: these pixels do not count.
    std::optional<std::array<float, 3>> behind;
    /// Indices in Dataset::points of the points that the reconstruction saw in this image. Null: the dataset does not say.
    std::shared_ptr<const std::vector<uint32_t>> seen;
    /// The median reprojection error of the points in `seen`, in px of the reconstruction's image. That image may have another size
    /// than the file. 0: not known.
    float point_error = 0;
    Distortion distortion;  // of the file; load_frame_image removes it; none with LensUse::native
    Camera pinhole;         // `camera` before downscaling
    int downscale = 1;      // factor that is applied to the file, which may be a smaller copy already
    int split = 0;          // 1 train, 2 test; 0: split_frames decides
    /// The frame's decoded image, while another owner keeps it in memory. scene::image_of then does not read the file again.
    std::weak_ptr<const KeptImage> kept;

    /// Whether alpha in load_frame_image's result is the weight of pixels.
    bool alpha_weighs() const { return left_out || masks == MaskUse::ignore; }
};

/// Points of a reconstruction, with their colours.
struct PointCloud {
    std::vector<glm::dvec3> positions;           // world
    std::vector<std::array<uint8_t, 3>> colors;  // sRGB
};

/// How many files, points or models of a kind a dataset has, and how many of them are used.
struct UsedOf {
    std::string what;  // "photo", "mask", "depth map", "point" or "model"
    /// The images' folder, relative to the dataset's. Empty: images/.
    std::string where = {};
    uint64_t used = 0, found = 0;
    std::string why = {};  // the first one that is not used, and the reason; empty: all are used
};

/// A dataset: cameras, image files and points. Images are not decoded.
struct Dataset {
    std::filesystem::path root;                // its folder
    std::vector<std::filesystem::path> files;  // of cameras and points; the frames name images and masks
    std::vector<Frame> frames;                 // sorted by name
    PointCloud points;                         // may be empty
    int missing_images = 0;                    // entries whose image file does not exist, or cannot be read
    std::vector<std::string> unreadable;       // names of images that exist, and why they count as missing
    int dropped_points = 0;           // points with a coordinate that is not finite; they are not in `points`
    std::string first_dropped_point;  // position of the first: file and byte, line or vertex
    /// False if the dataset has "view_dependent": false. Then SH degree 0 suffices.
    bool color_depends_on_view = true;
    std::string format, program;  // of the cameras; the program may be unknown, and empty
    /// Frames per second, if the cameras are the path of a film and have no images. 0: they are no such path.
    double frame_rate = 0;
    std::vector<std::string> notes;  // contents of the cameras' file that are skipped, one line each
    std::vector<UsedOf> used;        // counts of each kind that the dataset has
};

/// One line on Dataset::used: "8 of 8 photos, 0 of 8 masks (masks/0.png matches no photo), 200 points".
std::string used_text(const Dataset& dataset);

/// Options of load_dataset.
struct DatasetOptions {
    int downscale = 1;  // >= 1
    MaskUse masks = MaskUse::automatic;
    LensUse lens = LensUse::automatic;
    bool need_images = true;  // false: only cameras; frames without a file are kept if the size is known
    /// False: skips the separate file of points that a transforms.json names.
    bool need_points = true;
    /// Images that are wider after `downscale` are reduced to this width, px. 0: none are.
    int max_width = 0;
};

/// Loads a dataset. There are four kinds of paths:
/// - A folder with images and a COLMAP model (.bin or .txt). The model is in sparse/0 and so on, in sparse, in the folder itself, or
///   in a workspace such as dense/0. The model with the most images counts.
/// - A folder with transforms.json, or with transforms_train.json and transforms_test.json.
/// - A folder with the cameras of another program: Metashape, RealityScan, OpenSfM, OpenDroneMap, OpenMVG, Polycam or Record3D.
/// - One of these files. src/io/datasets/transforms.cpp has the dialects, and src/io/datasets/importers/ the other formats.
///
/// Images are searched in images/, input/ and the folder itself. Their names may differ in extension and case from those of the
/// cameras' file, and folders in the paths of that file may be missing.
///
/// Camera axes follow the OpenCV convention; the world frame is the file's own. With need_images, frames without a file are skipped
/// and counted. An image file has the size that the cameras' file states, or that size times one factor, which then scales the
/// intrinsics. As in COLMAP, cameras belong to the pixels as stored. EXIF's orientation is applied only if it is a quarter turn and
/// only the turned image has the model's aspect ratio. With a downscale factor K, images in images_K (beside images) are used as
/// they are. In a folder that make_dataset has made, an image that is cut off or no image counts as missing. Throws InputError.
Dataset load_dataset(const std::filesystem::path& path, const DatasetOptions& options);

/// The points that the reconstruction saw in a frame's image. These points determine the frame's camera.
struct CameraSupport {
    size_t points = 0;
    float error = 0;  // Frame::point_error
    struct Neighbor {
        int frame = 0;      // index into Dataset::frames
        size_t points = 0;  // that both frames see
    };
    std::vector<Neighbor> neighbors;  // the frames that see most of the same points, the most first
};
/// The CameraSupport of each frame, with at most `most` neighbours. Empty if the dataset does not say which frame sees which
/// points.
std::vector<CameraSupport> camera_support(const Dataset& dataset, size_t most = 3);
/// A text such as "312 points, 0.42 px; most in common with b.jpg (120) and c.jpg (88)".
std::string support_text(const Dataset& dataset, const CameraSupport& support);
/// A text such as "b.jpg (120) and c.jpg (88)". Empty without neighbours.
std::string neighbors_text(const Dataset& dataset, const CameraSupport& support);

/// Throws InputError unless `frames` are indices into dataset.frames. Functions that take both call it.
void check(const Dataset& dataset, const std::vector<int>& frames);

/// Loads the frame's image as `frame.camera` sees it: turned, reduced, undistorted and downscaled. Undistortion is bilinear and
/// keeps the focal lengths; the size changes so that no pixel is blank (src/scene/lens.h). The result has 3 channels, or 4 if the
/// frame has a mask or the file has alpha. The fourth channel is the product of mask and alpha, which is used as frame.masks says.
/// With frame.left_out, it is the weight of pixels. Throws InputError, also if a value of the file is not finite or left_out is not
/// an image of one channel.
Image load_frame_image(const Frame& frame);

/// The frame's image in the form that a render is compared with.
struct TrainingImage {
    Image image;    // RGB, composited over the background if masks cut
    Image weights;  // one channel, the weight of each pixel; empty if all count
};
/// Loads the frame's image for comparison with a render. background: RGB. Throws InputError as load_frame_image does.
TrainingImage load_training_image(const Frame& frame, const std::array<float, 3>& background);

/// Indices of train and test frames. A frame's own split wins. Otherwise it is a test frame if its index in the order of names is a
/// multiple of test_every, as in INRIA's code and gsplat. test_every 0: all frames without an own split are train frames; if no
/// train frame is left, all frames are.
struct Split {
    std::vector<int> train, test;
};
Split split_frames(const Dataset& dataset, int test_every);

/// 1.1 times the largest distance of a camera from the cameras' mean position (INRIA's cameras_extent,
/// getNerfppNorm), world units. Throws InputError for frames that the dataset lacks.
double scene_extent(const Dataset& dataset, const std::vector<int>& frames);

/// One splat per point, as in INRIA's create_from_pcd: identity rotation, opacity 0.1, colour in SH degree 0. World frame.
/// The scale is the root of the mean squared distance to the 3 nearest neighbours, which is at least 1e-7.
/// With fewer neighbours, the mean is over these; a single point has scale 1. Throws InputError without
/// points, if one is not finite or has no colour, or for an SH degree that is not 0 to 3.
Gaussians gaussians_from_points(const PointCloud& points, int sh_degree);

}  // namespace ewa
