// SPDX-License-Identifier: Apache-2.0
// The content of a dataset's model file, before any image is read, and the readers of the formats: COLMAP's
// sparse model, transforms.json (transforms.cpp describes its keys), and points as a PLY.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::io {

class ImageFinder;

/// One image of the model. The image file may not exist.
struct ImageRecord {
    std::string name;            // Frame::name
    std::filesystem::path path;  // of the image; empty for a camera of a path
    Camera camera;               // OpenCV axes; width and height are 0 if neither model nor image states them
    std::filesystem::path mask;  // the mask that the model names; empty: none
    std::filesystem::path depth;  // the depth map that the model names; empty: none
    double depth_unit = Frame().depth_unit;
    Distortion distortion;
    int split = 0;                 // Frame::split
    std::vector<uint32_t> seen{};  // Frame::seen; empty: the model does not say
    float point_error = 0;         // Frame::point_error
};

/// Points that are skipped: float32, in which splats are stored, cannot hold a coordinate as a finite number.
struct DroppedPoints {
    int count = 0;
    std::string first;  // file and byte, line or vertex of the first one
};

struct PlyPoints {
    PointCloud points;
    DroppedPoints dropped;
    size_t found = 0;  // finite points of the file
};

struct ImageRecords {
    std::filesystem::path folder;  // of the images; images_2 and so on beside it hold smaller copies
    std::vector<std::filesystem::path> files;  // Dataset::files
    std::vector<ImageRecord> images;           // in the order of the file
    PointCloud points;
    DroppedPoints dropped;
    bool color_depends_on_view = true;  // Dataset::color_depends_on_view
    std::string format, program;        // Dataset::format, Dataset::program
    double frame_rate = 0;              // Dataset::frame_rate
    std::vector<std::string> notes;     // Dataset::notes
    UsedOf models;                      // of Dataset::used; none: there is no other
};

/// Sets the intrinsics of a 360° image's camera. The width spans 360°, and the px per degree are the same along both sides.
/// Throws InputError that begins with `where` if the height spans more than 180°.
void set_sphere(Camera& camera, const std::string& where);

/// Adds a note if there are 360° images that do not show all directions.
void note_partial_spheres(ImageRecords& records);

/// Adds a point, or counts it as dropped and returns false. `where` is called for the first dropped point.
bool add_point(PointCloud& points, DroppedPoints& dropped, const glm::dvec3& position,
               const std::array<uint8_t, 3>& color, const std::function<std::string()>& where);

/// Reads the vertices of a PLY: x y z, in the frame of the file. Colours are red green blue, as integers
/// 0..255 or floating-point numbers 0..1. Without colours, points are mid-grey. Throws InputError that names
/// the file and the byte or property. most: a larger cloud is thinned evenly to so many, with memory for a few times as many.
PlyPoints read_points_ply(const std::filesystem::path& path, size_t most = SIZE_MAX / 8);

/// Whether the file is a PLY of points: vertices with x y z, which are not splats, and no faces. Throws InputError
/// where the file cannot be read, or is a PLY with a damaged header.
bool is_point_cloud(const std::filesystem::path& path);

/// Writes a binary PLY of x y z (float32) and red green blue (8 bits). Throws RunError.
void write_points_ply(const std::filesystem::path& path, const PointCloud& points);

/// Cameras and images of COLMAP.
struct ColmapModel {
    std::filesystem::path folder;        // of the files
    std::filesystem::path dataset = {};  // the folder that the images are in or below
    /// A folder above `dataset`. It and the folders between may have images too. Empty: no other folder has any.
    std::filesystem::path originals = {};
    std::string extension = ".bin";  // or .txt
    uint64_t images = 0;             // only counted where there are several models
};

/// The COLMAP models of a dataset, in sparse/0 and so on, sparse, or `root` itself. The one with the most images is first. As in
/// COLMAP, .bin files are preferred.
std::vector<ColmapModel> colmap_models(const std::filesystem::path& root);
/// The model whose files are directly in this folder.
ColmapModel colmap_model_in(const std::filesystem::path& folder);
/// The models of a COLMAP workspace in the folder: dense/0 and so on, dense, undistorted, distorted or colmap.
std::vector<ColmapModel> colmap_workspaces(const std::filesystem::path& root);
/// The models of other folders, up to three levels below `root`. Empty if several of these folders are datasets.
std::vector<ColmapModel> colmap_models_below(const std::filesystem::path& root);
/// The number of images in the model's file; 0 if it cannot be read.
uint64_t count_images(const ColmapModel& model);
/// The finder for the images that the model names.
ImageFinder image_finder(const ColmapModel& model);

/// Reads a model. Without `images`, the images have no paths. With them, missing points are those of points3D.ply in its folder or the
/// dataset's, or of fused.ply beside the images. World and cameras are as in the file: COLMAP's axes are
/// OpenCV's. Every lens model of COLMAP is supported.
/// Throws InputError that names the file and the byte (.bin) or line (.txt).
ImageRecords read_colmap(const ColmapModel& model, const ImageFinder* images = nullptr);

/// Whether COLMAP has a lens model for the image: one with these terms, or the whole sphere.
bool fits_colmap(const ImageRecord& image);

/// Writes a binary model with these images, cameras and points into the folder, which is created. The images' paths, masks
/// and splits are not used. Throws RunError.
void write_colmap(const std::filesystem::path& model, const std::vector<ImageRecord>& images,
                  const PointCloud& points);

/// Reads the file. Cameras get OpenCV's axes; the world frame stays the file's. nerfstudio's
/// applied_transform is ignored, because it already applies to cameras and points alike. A rotation with a
/// uniform factor or a little noise becomes orthonormal. `split` becomes each image's. with_points false
/// skips the points. root: the dataset's folder, which may be above the file's; empty: it is not.
/// Throws InputError that names the file and the byte or frame.
ImageRecords read_transforms(const std::filesystem::path& path, int split, bool with_points,
                             const std::filesystem::path& root = {});

struct TransformsFrame {
    std::string image, depth;  // relative to the file's folder, with / between the parts
    Camera camera;
};

struct TransformsFile {
    std::vector<TransformsFrame> frames;
    std::string points;                                        // relative; empty: none
    bool color_depends_on_view = true;                         // false is written as "view_dependent": false
    std::vector<std::pair<std::string, std::string>> remarks;  // further keys and texts at the top
};

/// Writes the intrinsics into each frame. The world frame stays. Throws RunError.
void write_transforms(const std::filesystem::path& path, const TransformsFile& file);

}  // namespace ewa::io
