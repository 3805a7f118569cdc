// SPDX-License-Identifier: Apache-2.0
// Images with their cameras, and the points they were reconstructed from.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa {

/// How a lens bends the ray (x, y, 1); src/scene/lens.h has the formulas.
enum class Lens {
    brown,    // radial (a quotient of polynomials) and tangential: OpenCV's perspective model
    fisheye,  // radial in the angle, tangential, thin prism: OpenCV's fisheye and COLMAP's THIN_PRISM_FISHEYE
    fisheye624,  // six radial terms, then tangential and thin prism of the result: COLMAP's
                 // RAD_TAN_THIN_PRISM_FISHEYE
    fov,         // Devernay and Faugeras 2001; k1 is omega (radians)
    division,    // Fitzgibbon 2001; k1
    unified      // enhanced unified camera model, Khomutenko et al. 2016; k1 is alpha, k2 is beta
};

/// What a lens adds to a pinhole. Names and signs are OpenCV's (calib3d, "Detailed Description"); a lens
/// leaves those it has no use for at zero.
struct Distortion {
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;
    double s1 = 0, s2 = 0, s3 = 0,
           s4 = 0;  // thin prism: s1 and s3 times the squared radius, s2 and s4 times its square
    Lens lens = Lens::brown;
    bool operator==(const Distortion&) const = default;
    /// A pinhole: nothing to undo.
    bool none() const { return *this == Distortion{}; }
};

/// What masks are for. A mask is white where its picture counts: a file in masks/ (beside images/) that has
/// the picture's name, with .png in place of its extension or after it; a frame's mask_path in
/// transforms.json; or a picture's own alpha.
enum class MaskUse {
    automatic,  // ignore where the dataset has mask files, else cut
    ignore,     // pixels under the mask do not count, in the loss and in PSNR and SSIM
    cut,        // pixels under the mask are the background's colour
    none        // neither masks nor alpha are looked at
};

struct Frame {
    std::string name;                  // as the dataset names it, e.g. "0001.jpg"
    std::filesystem::path image_path;  // may not exist: see image_exists
    bool image_exists = false;
    int orientation = 1;    // EXIF's, of the file: 1 unless the camera belongs to the turned picture
    bool eight_bit = true;  // the file has no more than 256 levels
    Camera camera;          // the pinhole camera that load_frame_image's picture has
    Camera source;          // intrinsics of the file itself (differs where it is distorted or scaled)
    std::filesystem::path mask_path;  // empty: none
    MaskUse masks = MaskUse::cut;     // what alpha is for in load_frame_image's picture; never automatic
    Distortion distortion;            // of the file
    Camera pinhole;                   // of the file's picture once it is undistorted, before it is downscaled
    int downscale = 1;                // of the file's picture, which may be a smaller copy already
    int split = 0;  // 0 by the rule of split_frames; 1 train, 2 test where the dataset says so
};

struct PointCloud {
    std::vector<glm::dvec3> positions;           // world
    std::vector<std::array<uint8_t, 3>> colors;  // sRGB
};

struct Dataset {
    std::filesystem::path root;
    std::vector<Frame> frames;        // sorted by name
    PointCloud points;                // may be empty
    int missing_images = 0;           // entries whose image file is not there
    int dropped_points = 0;           // points with a coordinate that is not finite, left out of `points`
    std::string first_dropped_point;  // where the first of them stands: file and byte, line or vertex
    bool color_depends_on_view =
        true;  // false where the dataset says that SH degree 0 suffices: "view_dependent": false
};

struct DatasetOptions {
    int downscale = 1;  // >= 1
    MaskUse masks = MaskUse::automatic;
    bool need_images = true;  // false: cameras alone; frames without a file are kept where the size is known
};

/// A folder with a COLMAP model (.bin or .txt, in sparse/0, sparse or the folder itself) and images/, else a
/// folder with transforms.json or transforms_train.json and transforms_test.json, or one of these files
/// (src/io/transforms.h has the dialects). World coordinates and camera axes come out in the OpenCV
/// convention; the world frame is the file's own. With need_images, frames without a file are left out and
/// counted, and every other file's size is checked against the model: it is the model's, or the model's
/// resized by one factor, which the intrinsics then follow. Cameras belong to the pixels as they are stored,
/// which is how COLMAP reads them; EXIF's orientation is followed only where it asks for a quarter turn and
/// the turned picture has the model's shape while the stored one has not. With a downscale factor K, a
/// picture that is in images_K (beside images) is taken from there as it is. Throws InputError.
Dataset load_dataset(const std::filesystem::path& path, const DatasetOptions& options);

/// The frame's picture as the pinhole `frame.camera` sees it: undistorted (bilinear; the focal lengths stay
/// and the size changes so that no pixel is blank, src/scene/undistort.h) and downscaled as the frame says. 3
/// channels, or 4 where the frame has a mask or the file alpha: their product, for the use that frame.masks
/// says. Throws InputError, also where a value of the file is not finite.
Image load_frame_image(const Frame& frame);

/// The same as a rendering is compared with it.
struct TrainingImage {
    Image picture;  // RGB, over the background where it is cut out
    Image weights;  // one channel, how much a pixel counts; empty where each counts
};
TrainingImage load_training_image(const Frame& frame, const std::array<float, 3>& background);

/// Indices of train and test frames: a frame's own split where the dataset has one, else test where its index
/// in name order is a multiple of test_every (INRIA's and gsplat's rule); test_every 0: all train.
struct Split {
    std::vector<int> train, test;
};
Split split_frames(const Dataset& dataset, int test_every);

/// 1.1 times the largest distance of a camera from the cameras' mean position (INRIA's cameras_extent,
/// getNerfppNorm).
double scene_extent(const Dataset& dataset, const std::vector<int>& frames);

/// One splat a point: scale sqrt(mean squared distance to the 3 nearest neighbours, squared distance at least
/// 1e-7), identity rotation, opacity 0.1, colour in SH degree 0 (INRIA's create_from_pcd). With fewer than 3
/// other points the mean is over those there are; a single point gets scale 1. Throws InputError without
/// points, or when one is not finite.
Gaussians gaussians_from_points(const PointCloud& points, int sh_degree);

}  // namespace ewa
